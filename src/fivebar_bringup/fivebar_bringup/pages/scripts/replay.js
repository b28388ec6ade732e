// SPDX-License-Identifier: Apache-2.0
// Plays recorded runs: one clock moves the robots on the canvas and the cursor in the charts.
"use strict";

const SLOWED = 0.1;

function numbers(base64) {
  const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

class Track {
  constructor(run) {
    this.run = run;
    this.columns = Object.fromEntries(Object.entries(run.columns).map(([name, text]) => [name, numbers(text)]));
    this.time = this.columns.time;
    this.last = this.time.length - 1;
    this.end = this.time[this.last];
    this.pieces = this.splitByMode();
  }

  // The last row at or before a time; half of the time's resolution is forgiven.
  row(time) {
    let low = 0, high = this.last;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time + 1e-6) low = middle; else high = middle - 1;
    }
    return low;
  }

  // The posture at a time, between two rows in proportion.
  posture(time) {
    const row = this.row(time), next = Math.min(row + 1, this.last), period = this.time[next] - this.time[row];
    const share = period > 0 ? Math.min(1, Math.max(0, (time - this.time[row]) / period)) : 0;
    const at = (name) => {
      const from = this.columns[name][row], to = this.columns[name][next];
      return share < 1e-3 ? from : from + share * (to - from);
    };
    return { x: at("x"), y: at("y"), q11: at("q11"), q21: at("q21"), mode: this.columns.mode[row] };
  }

  // Rows of one assembly mode after the other.
  splitByMode() {
    const pieces = [], mode = this.columns.mode;
    for (let row = 0; row <= this.last; row++) {
      const open = pieces[pieces.length - 1];
      if (open && open.mode === mode[row]) open.last = row;
      else pieces.push({ mode: mode[row], first: row, last: row });
    }
    return pieces;
  }

  trail(time) {
    const row = this.row(time);
    return this.pieces.filter((piece) => piece.first <= row).map((piece) => {
      const points = [], last = Math.min(piece.last + 1, row), step = Math.max(1, Math.floor(row / 3000));
      for (let each = piece.first; each <= last; each += step) points.push([this.columns.x[each], this.columns.y[each]]);
      points.push([this.columns.x[last], this.columns.y[last]]);
      return { mode: piece.mode, points };
    });
  }
}

class Player {
  constructor(data) {
    const find = (name) => document.getElementById(`replay-${name}`);
    this.tracks = data.runs.map((run) => new Track(run));
    this.end = Math.max(...this.tracks.map((track) => track.end));
    this.zones = data.runs[0].zones;
    this.faults = data.runs.flatMap((run) => run.faults);
    this.charted = data.charts;
    this.stage = new Stage(find("stage"), data.scene);
    this.charts = new Charts(find("charts"), data.charts, this.tracks.map((track) => track.columns), this.zones,
      this.faults, (time) => this.seek(time));
    this.charts.span(0, this.end || 1);
    this.ready = this.charts.shown;
    this.controls = { play: find("play"), time: find("time"), speed: find("speed"), slow: find("slow") };
    this.texts = { clock: find("clock"), fault: find("fault"), values: find("values") };
    this.playing = false;
    this.time = 0;
    this.controls.time.max = this.end;
    this.listen(find("player"));
    this.buildValues();
    this.seek(0);
  }

  listen(holder) {
    this.controls.play.addEventListener("click", () => this.toggle());
    document.getElementById("replay-csv").addEventListener("click", () => this.save());
    this.controls.time.addEventListener("input", () => this.seek(Number(this.controls.time.value)));
    document.addEventListener("keydown", (event) => {
      const on = event.target;
      if (event.ctrlKey || event.metaKey || event.altKey || on instanceof HTMLSelectElement) return;
      if (!holder.contains(on) && on !== document.body) return;
      const own = { ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), Home: () => this.seek(0),
        End: () => this.seek(this.end) }[event.key];
      if (event.key === " " && !(on instanceof HTMLButtonElement) && on.type !== "checkbox") this.toggle();
      else if (own) own();
      else return;
      event.preventDefault();
    });
  }

  step(count) {
    this.pause();
    const track = this.tracks[0];
    this.seek(track.time[Math.min(track.last, Math.max(0, track.row(this.time) + count))]);
  }

  toggle() {
    if (this.playing) return this.pause();
    if (this.time >= this.end) this.seek(0);
    this.playing = true;
    this.label();
    let before = null;
    const frame = (now) => {
      if (!this.playing) return;
      if (before !== null) this.seek(this.time + this.pace() * (now - before) / 1000);
      before = now;
      if (this.time >= this.end) this.pause(); else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  pace() {
    const near = this.zones.some(([from, to]) => this.time >= from && this.time <= to);
    return Number(this.controls.speed.value) * (this.controls.slow.checked && near ? SLOWED : 1);
  }

  pause() {
    this.playing = false;
    this.label();
  }

  label() {
    this.controls.play.textContent = this.playing ? "Pause" : "Play";
    this.controls.play.setAttribute("aria-pressed", String(this.playing));
  }

  seek(time) {
    this.time = Math.min(this.end, Math.max(0, time));
    this.controls.time.value = this.time;
    this.controls.time.setAttribute("aria-valuetext", `${this.time.toFixed(3)} s`);
    const modes = this.tracks.map((track) => modeName(track.columns.mode[track.row(this.time)]));
    this.texts.clock.textContent = `${this.time.toFixed(3)} s of ${this.end.toFixed(3)} s, ${modes.join(" and ")}`;
    const happened = this.faults.filter((fault) => fault.time <= this.time + 1e-6);
    this.texts.fault.textContent = happened.map((fault) => `${fault.time.toFixed(3)} s: ${fault.text}`).join("\n");
    this.texts.fault.hidden = !happened.length;
    this.stage.show(this.tracks.map((track, number) => ({
      robot: track.run.robot, posture: track.posture(this.time), trail: track.trail(this.time), second: number > 0 })));
    this.charts.at(this.time);
    this.showValues();
  }

  // The columns of each run as a file, with units in the row of names.
  save() {
    const units = { time: "s", x: "mm", y: "mm", q11: "rad", q21: "rad" };
    for (const chart of this.charted) for (const line of chart.lines) units[line.column] = chart.unit;
    for (const track of this.tracks) {
      const names = Object.keys(track.columns);
      const lines = [names.map((name) => (units[name] ? `${name} (${units[name]})` : name)).join(",")];
      for (let row = 0; row <= track.last; row++)
        lines.push(names.map((name) => (Number.isFinite(track.columns[name][row]) ? Number(track.columns[name][row].toPrecision(7)) : "")).join(","));
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([lines.join("\n") + "\n"], { type: "text/csv" }));
      link.download = `${track.run.name.replace(/[^\w.-]+/g, "_") || "run"}.csv`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
    }
  }

  buildValues() {
    this.cells = [];
    if (this.tracks.length > 1) {
      const row = this.texts.values.insertRow();
      row.insertCell();
      this.tracks.forEach((_, number) => {
        const name = document.createElement("th");
        name.scope = "col";
        name.textContent = `run ${number + 1}`;
        row.append(name);
      });
    }
    for (const chart of this.charted) for (const line of chart.lines) {
      const row = this.texts.values.insertRow(), name = document.createElement("th");
      name.scope = "row";
      name.textContent = line.label;
      if (line.meaning) {
        const meaning = document.createElement("small");
        meaning.textContent = ` ${line.meaning}`;
        name.append(meaning);
      }
      row.append(name);
      for (const track of this.tracks) this.cells.push({ track, line, unit: chart.unit, cell: row.insertCell() });
    }
  }

  showValues() {
    for (const { track, line, unit, cell } of this.cells) {
      const column = track.columns[line.column], value = column ? column[track.row(this.time)] : NaN;
      cell.textContent = Number.isFinite(value) ? `${value.toFixed(3).replace(/^-(?=[0.]*$)/, "")} ${unit}` : "–";
    }
  }
}

window.replay = new Player(JSON.parse(document.getElementById("replay-data").textContent));
