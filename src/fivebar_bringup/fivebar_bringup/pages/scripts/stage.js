// SPDX-License-Identifier: Apache-2.0
// The robot's plane on a canvas, to scale: assembly modes, loci, path, trails and robots. Lengths in mm, angles in rad.
"use strict";

const COLOURS = {
  light: { ink: "#1f2430", soft: "#5b6472", line: "#d9dde4", card: "#ffffff", positive: "#e8f1f8", negative: "#fdf0e6",
    boundary: "#6b7280", locus: "#9b4f96", path: "#b9c0cc", plus: "#0072b2", minus: "#d55e00", good: "#009e73",
    zone: "#f6d776", zoneAlpha: 0.45, second: "#8a93a5" },
  dark: { ink: "#e7e9ee", soft: "#a4adbb", line: "#363d4a", card: "#1d222b", positive: "#1b2b38", negative: "#362a20",
    boundary: "#8a93a5", locus: "#d48ed0", path: "#4c5565", plus: "#56b4e9", minus: "#ff9a4d", good: "#35c496",
    zone: "#b8922a", zoneAlpha: 0.3, second: "#79839a" },
};
const LITTLE_GRIP = 0.1, LOST_LENGTH = 25;
const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const colours = () => COLOURS[DARK.matches ? "dark" : "light"];

// The five joints of a posture: motor 1, elbow 1, platform, elbow 2, motor 2.
function jointsOf(robot, posture) {
  const elbow = (leg, angle) => [
    robot.base[leg] + robot.proximal[leg] * Math.cos(angle), robot.proximal[leg] * Math.sin(angle)];
  return [[robot.base[0], 0], elbow(0, posture.q11), [posture.x, posture.y], elbow(1, posture.q21), [robot.base[1], 0]];
}

// Where a posture's platform cannot be controlled, or hardly: the direction t_s, and kappa = 1/cond(A), 0 on the locus.
function gripOf([, elbow1, platform, elbow2]) {
  const along = (elbow) => {
    const far = Math.hypot(platform[0] - elbow[0], platform[1] - elbow[1]);
    return [(platform[0] - elbow[0]) / far, (platform[1] - elbow[1]) / far];
  };
  const one = along(elbow1), two = along(elbow2), cosine = one[0] * two[0] + one[1] * two[1], fold = cosine < 0 ? -1 : 1;
  const kept = [one[0] + fold * two[0], one[1] + fold * two[1]], length = Math.hypot(...kept);
  const kappa = Math.abs(one[0] * two[1] - one[1] * two[0]) / (1 + Math.abs(cosine));
  return { kappa, direction: [-kept[1] / length, kept[0] / length] };
}

const modeName = (mode) => (mode > 0 ? "assembly mode +" : mode < 0 ? "assembly mode −" : "on the locus");

// Adds a point to a trail, whose pieces are of one assembly mode each and hang together.
function extendTrail(trail, mode, point) {
  const open = trail[trail.length - 1];
  if (open && open.mode === mode) open.points.push(point);
  else trail.push({ mode, points: open ? [open.points[open.points.length - 1], point] : [point] });
}

class Stage {
  // `scene`: bounds [left, bottom, right, top], polygons `positive` and `negative`, lines `locus`, `boundary`, `path`;
  // `second`, if there are two runs: what of `locus`, `path` and `waypoints` differs in the second one.
  constructor(canvas, scene) {
    this.canvas = canvas;
    this.scene = scene;
    this.drawn = [];
    this.marks = [];
    this.background = document.createElement("canvas");
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    DARK.addEventListener("change", () => this.resize());
    this.resize();
  }

  resize() {
    const [left, bottom, right, top] = this.scene.bounds;
    const width = Math.max(240, this.canvas.parentElement.clientWidth);
    this.ratio = window.devicePixelRatio || 1;
    this.scale = width / (right - left);
    const height = Math.round(width * (top - bottom) / (right - left));
    for (const canvas of [this.canvas, this.background]) {
      canvas.width = Math.round(width * this.ratio);
      canvas.height = Math.round(height * this.ratio);
    }
    this.canvas.style.height = `${height}px`;
    this.paintBackground();
    this.paint();
  }

  // A point of the plane (mm) in CSS pixels of the canvas, and back.
  toPixel([x, y]) {
    return [(x - this.scene.bounds[0]) * this.scale, (this.scene.bounds[3] - y) * this.scale];
  }

  toPlane([column, row]) {
    return [column / this.scale + this.scene.bounds[0], this.scene.bounds[3] - row / this.scale];
  }

  // The point of the plane (mm) under a mouse or a finger.
  under(event) {
    const box = this.canvas.getBoundingClientRect();
    return this.toPlane([event.clientX - box.left, event.clientY - box.top]);
  }

  // `items`: robots with posture, trail and whether it is the second of two; `marks`: further points with a label.
  show(items, marks = []) {
    this.drawn = items.map((item) => ({ ...item, joints: jointsOf(item.robot, item.posture) }));
    this.marks = marks;
    this.paint();
  }

  begin(canvas) {
    const pen = canvas.getContext("2d");
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.lineCap = pen.lineJoin = "round";
    return pen;
  }

  line(pen, points, colour, width, alpha = 1) {
    pen.beginPath();
    for (const point of points) pen.lineTo(...this.toPixel(point));
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.globalAlpha = alpha;
    pen.stroke();
    pen.globalAlpha = 1;
  }

  dot(pen, point, radius, fill, edge) {
    pen.beginPath();
    pen.arc(...this.toPixel(point), radius, 0, 2 * Math.PI);
    pen.fillStyle = fill;
    pen.fill();
    pen.strokeStyle = edge;
    pen.lineWidth = 1.5;
    pen.stroke();
  }

  label(pen, text, point, shift) {
    const [column, row] = this.toPixel(point);
    pen.font = "600 13px system-ui, sans-serif";
    pen.textAlign = shift[0] < 0 ? "right" : shift[0] > 0 ? "left" : "center";
    pen.lineWidth = 3;
    pen.strokeStyle = colours().card;
    pen.fillStyle = colours().ink;
    pen.strokeText(text, column + shift[0], row + shift[1]);
    pen.fillText(text, column + shift[0], row + shift[1]);
  }

  // Near the locus the direction that the motors have lost.
  paintLost(pen, joints) {
    const { kappa, direction } = gripOf(joints), [x, y] = joints[2];
    if (!(kappa < LITTLE_GRIP)) return;
    const end = (size) => [x + size * direction[0], y + size * direction[1]];
    this.line(pen, [end(-LOST_LENGTH), end(LOST_LENGTH)], colours().minus, 2.5);
    this.label(pen, "tₛ: no torque acts along it", end(LOST_LENGTH), [8, 4]);
  }

  paintBackground() {
    const pen = this.begin(this.background), tint = colours(), scene = this.scene;
    for (const sign of ["negative", "positive"]) {
      pen.beginPath();
      for (const polygon of scene[sign]) {
        polygon.forEach((point, number) => pen[number ? "lineTo" : "moveTo"](...this.toPixel(point)));
        pen.closePath();
      }
      pen.fillStyle = tint[sign];
      pen.fill("evenodd");
    }
    for (const line of scene.boundary) this.line(pen, line, tint.boundary, 1.4);
    for (const line of scene.locus) this.line(pen, line, tint.locus, 2.2);
    if (scene.path.length) this.line(pen, scene.path, tint.path, 5);
    if (scene.second) {
      pen.setLineDash([7, 6]);
      for (const line of scene.second.locus) this.line(pen, line, tint.locus, 2.2, 0.7);
      if (scene.second.path.length) this.line(pen, scene.second.path, tint.second, 3);
      pen.setLineDash([]);
      for (const [, x, y] of scene.second.waypoints) this.dot(pen, [x, y], 3.5, tint.second, tint.card);
    }
    for (const [name, x, y] of scene.waypoints) {
      this.dot(pen, [x, y], 3.5, tint.ink, tint.card);
      this.label(pen, name, [x, y], [x < 0 ? -9 : 9, 4]);
    }
  }

  paint() {
    const pen = this.begin(this.canvas), tint = colours();
    pen.drawImage(this.background, 0, 0, this.canvas.width / this.ratio, this.canvas.height / this.ratio);
    for (const item of this.drawn) {
      for (const piece of item.trail || [])
        this.line(pen, piece.points, piece.mode > 0 ? tint.plus : tint.minus, 2, item.second ? 0.5 : 1);
    }
    for (const item of this.drawn) if (!item.second && !item.plain) this.paintLost(pen, item.joints);
    for (const item of [...this.drawn].reverse()) {
      const colour = item.second ? tint.second : tint.ink;
      this.line(pen, item.joints, colour, item.second ? 4 : 6, item.second ? 0.8 : 1);
      for (const elbow of [1, 3]) this.dot(pen, item.joints[elbow], 4.5, tint.card, colour);
      for (const motor of [0, 4]) this.dot(pen, item.joints[motor], 7, colour, tint.card);
      this.dot(pen, item.joints[2], 7, item.posture.mode > 0 ? tint.plus : tint.minus, tint.card);
    }
    for (const mark of this.marks) {
      if (mark.line) this.line(pen, mark.line, mark.bad ? tint.minus : tint.good, 2.5);
      this.dot(pen, mark.point, 6, "transparent", mark.bad ? tint.minus : tint.good);
      this.label(pen, mark.label, mark.point, [10, -8]);
    }
  }
}
