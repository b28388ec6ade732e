// SPDX-License-Identifier: Apache-2.0
// A chart of a run over time on a canvas: lines, a band of what the drives can give, the crossing and a cursor.
"use strict";

class PlayChart {
  // `log`: beyond +-1 the axis is logarithmic, so that torques from 0.1 to 1e6 Nm have room.
  constructor(canvas, log) {
    this.canvas = canvas;
    this.log = log;
    new ResizeObserver(() => this.paint()).observe(canvas.parentElement);
    DARK.addEventListener("change", () => this.paint());
  }

  // `lines`: arrays of values, one for each sample; `end` and `crossing` in s, `limit` as the values.
  show(chart) {
    this.chart = chart;
    this.paint();
  }

  scaled(value) {
    return this.log && Math.abs(value) > 1 ? Math.sign(value) * (1 + Math.log10(Math.abs(value))) : value;
  }

  paint() {
    if (!this.chart) return;
    const { lines, end, period, crossing, limit, cursor, unit } = this.chart, tint = colours();
    const width = this.canvas.parentElement.clientWidth, height = 132, ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.canvas.style.height = `${height}px`;
    const pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const known = lines.flatMap((line) => line.values.filter(Number.isFinite).map((value) => Math.abs(value)));
    const most = this.scaled(Math.max(this.log ? 1.2 * limit : 0.1, ...known) * 1.1), least = this.log ? -most : 0;
    const left = 62, right = width - 10, top = 10, bottom = height - 20;
    const column = (time) => left + (right - left) * time / end;
    const row = (value) => bottom - (bottom - top) * (this.scaled(value) - least) / (most - least);
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = tint.zone;
    pen.globalAlpha = tint.zoneAlpha;
    if (limit) pen.fillRect(left, row(limit), right - left, row(this.log ? -limit : 0) - row(limit));
    pen.globalAlpha = 1;
    const rule = (x1, y1, x2, y2, colour, dash = []) => {
      pen.beginPath();
      pen.setLineDash(dash);
      pen.moveTo(x1, y1);
      pen.lineTo(x2, y2);
      pen.strokeStyle = colour;
      pen.lineWidth = 1;
      pen.stroke();
      pen.setLineDash([]);
    };
    pen.fillStyle = tint.soft;
    pen.textAlign = "right";
    for (const value of this.ticks(most)) {
      rule(left, row(value), right, row(value), tint.line);
      pen.fillText(`${PlayChart.short(value)} ${unit}`, left - 6, row(value) + 4);
    }
    pen.textAlign = "center";
    if (crossing < end) {
      rule(column(crossing), top, column(crossing), bottom, tint.locus, [4, 3]);
      pen.fillStyle = tint.locus;
      pen.fillText("locus", column(crossing), height - 5);
    }
    pen.fillStyle = tint.soft;
    pen.textAlign = "left";
    pen.fillText("0 s", left, height - 5);
    pen.textAlign = "right";
    pen.fillText(`${end.toPrecision(2)} s`, right, height - 5);
    for (const line of lines) {
      pen.beginPath();
      line.values.forEach((value, number) => {
        if (Number.isFinite(value)) pen.lineTo(column(number * period), row(value));
      });
      pen.strokeStyle = tint[line.colour];
      pen.lineWidth = 1.8;
      pen.lineJoin = "round";
      pen.stroke();
    }
    if (cursor !== null) rule(column(cursor), top, column(cursor), bottom, tint.ink);
  }

  ticks(most) {
    if (!this.log) {
      const step = 10 ** Math.floor(Math.log10(most)), wide = most / step > 5 ? 2 * step : most / step > 2 ? step : step / 2;
      return Array.from({ length: Math.floor(most / wide) + 1 }, (_, number) => number * wide);
    }
    const decades = Math.floor(most - 1), apart = Math.ceil(decades / 2), sizes = [];
    for (let decade = apart; decade <= decades; decade += apart) sizes.push(10 ** decade);
    return [...sizes.map((size) => -size), 0, ...sizes];
  }

  static short(value) {
    const size = Math.abs(value), sign = value < 0 ? "−" : "";
    return size >= 1e6 ? `${sign}${size / 1e6}M` : size >= 1e3 ? `${sign}${size / 1e3}k` : `${sign}${+size.toPrecision(2)}`;
  }
}
