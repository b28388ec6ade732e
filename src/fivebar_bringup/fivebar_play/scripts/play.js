// SPDX-License-Identifier: Apache-2.0
// The page that explains by play. `model` is the project's own code, translated; here are the hands and the eyes.
"use strict";

const LAWS = [
  ["ctc", "computed torque"],
  ["multi_joint", "blended, joints"],
  ["multi_cartesian", "blended, Cartesian"],
  ["unified", "unified"],
  ["mpc", "mpc, recorded"],
];
const FAULTS = { 1: "torque", 2: "speed", 3: "reach", 4: "leg stretched", 5: "path lost", 8: "speed", 10: "torque" };
const SLIDERS = ["duration", "push", "longer"];
const SLOW = 0.3;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const PUSH_TIME = 0.05, NEAR = "near";

// A line from the platform that the stage draws besides robots: ellipse, direction t_s, way across.
class PlayStage extends Stage {
  paint() {
    super.paint();
    if (!this.over) return;
    const pen = this.canvas.getContext("2d"), tint = colours();
    for (const { points, colour, width, dash } of this.over.lines) {
      pen.setLineDash(dash || []);
      this.line(pen, points, tint[colour], width, 0.9);
      pen.setLineDash([]);
    }
    for (const { point, text, shift } of this.over.labels) this.label(pen, text, point, shift);
    if (this.over.goal) this.dot(pen, this.over.goal, 6, tint.card, tint.soft);
  }
}

class Play {
  constructor(data) {
    this.data = data;
    this.recorded = data.recorded.map((run) => ({ ...run, samples: run.rows.map((row) =>
      Object.fromEntries(run.columns.map((name, number) => [name, row[number] === null ? NaN : row[number]]))) }));
    this.stage = new PlayStage(this.find("stage"), data.scene);
    this.torques = new PlayChart(this.find("torques"), true);
    this.errors = new PlayChart(this.find("errors"), false);
    this.law = "ctc";
    [this.x, this.y] = data.start;
    this.time = null;
    this.fillTable();
    this.listen();
    this.renew();
  }

  find(name) {
    return document.getElementById(`play-${name}`);
  }

  fillTable() {
    this.find("laws").tBodies[0].innerHTML = LAWS.map(([law, title], number) =>
      `<tr><th scope="row"><label><input type="radio" name="law" value="${law}"${number ? "" : " checked"}> ${title}</label></th><td></td><td></td></tr>`).join("");
  }

  listen() {
    const canvas = this.find("stage");
    const follow = (event) => {
      const [x, y] = this.stage.under(event);
      this.move(x / 1e3, y / 1e3);
    };
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); follow(event); });
    canvas.addEventListener("pointermove", (event) => { if (canvas.hasPointerCapture(event.pointerId)) follow(event); });
    for (const name of SLIDERS) this.find(name).addEventListener("input", () => this.renew());
    this.find("laws").addEventListener("change", (event) => this.choose(event.target.value));
    this.find("cross").addEventListener("click", () => this.cross());
    this.find("reset").addEventListener("click", () => this.startAgain());
    this.find("time").addEventListener("input", (event) => { this.playing = false; this.show(+event.target.value); });
    document.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    const own = event.target.closest("input, button"), arrow = ARROWS[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (arrow && !(own && own.type !== "button")) {
      const step = event.shiftKey ? 0.01 : 0.001;
      this.move(this.x + arrow[0] * step, this.y + arrow[1] * step);
    } else if (event.key === "Enter" && !own) this.cross();
    else if (event.key === " " && !own) this.pause();
    else if (event.key >= "1" && event.key <= String(LAWS.length)) {
      this.choose(LAWS[event.key - 1][0]);
      document.querySelector(`[name="law"][value="${this.law}"]`).checked = true;
    } else return;
    event.preventDefault();
  }

  choose(law) {
    this.law = law;
    this.playing = false;
    this.show(null);
  }

  startAgain() {
    [this.x, this.y] = this.data.start;
    for (const name of SLIDERS) this.find(name).value = this.find(name).defaultValue;
    this.renew();
  }

  move(x, y) {
    const state = model.state_from_platform(model.robot, ...model.mode, x, y, 0, 0);
    if (!Number.isFinite(state.leg1.q1) || !Number.isFinite(state.leg2.q1)) return;
    [this.x, this.y] = [x, y];
    this.renew();
  }

  // What follows from platform and sliders: the way across, and the runs of all controllers.
  renew() {
    this.playing = false;
    this.duration = +this.find("duration").value;
    this.push = +this.find("push").value;
    this.longer = +this.find("longer").value;
    const told = { duration: `${this.duration.toFixed(1)} s`, push: `${this.push.toFixed(1)} N`, longer: `${(this.longer / 10).toFixed(1)} mm` };
    for (const [name, text] of Object.entries(told)) this.find(name).nextElementSibling.textContent = text;
    const here = this.wayAcross(this.x, this.y);
    if (here !== NEAR) this.from = [this.x, this.y];
    this.motion = here === NEAR ? this.wayAcross(...this.from) : here;
    this.runs = Object.fromEntries(LAWS.map(([law]) => [law, this.motion ? this.run(law) : null]));
    const cells = this.find("laws").tBodies[0].rows;
    LAWS.forEach(([law], number) => this.judge(cells[number], this.runs[law]));
    this.find("cross").disabled = !this.motion;
    this.show(null);
  }

  // Straight over the nearest point of the locus, and as far again: half way the reference has no acceleration.
  // Null where there is no such way, `NEAR` where there is no room for one.
  wayAcross(x0, y0) {
    let nearest = null, distance = Infinity;
    for (const [x, y] of [...this.data.scene.locus, ...this.data.scene.second.locus].flat()) {
      const far = Math.hypot(x / 1e3 - x0, y / 1e3 - y0);
      if (far < distance) [nearest, distance] = [[x / 1e3, y / 1e3], far];
    }
    if (distance < 0.01) return NEAR;
    const to = (share) => new model.Segment(x0, y0, x0 + share * (nearest[0] - x0), y0 + share * (nearest[1] - y0), 0, this.duration);
    const cross = (segment) => model.play_motion(model.robot, ...model.mode, segment, model.zone_time);
    const share = cross(to(2)).share;
    if (!(share > 0)) return null;
    const segment = to(4 * share), motion = cross(segment);
    const back = cross(new model.Segment(segment.end_x, segment.end_y, segment.start_x, segment.start_y, 0, this.duration));
    return model.least_reach(model.robot, segment) > 1e-3 && Math.abs(1 - motion.share - back.share) < 1e-6 ? motion : null;
  }

  run(law) {
    if (law === "mpc") {
      const home = Math.hypot(this.from[0] - this.data.start[0], this.from[1] - this.data.start[1]) < 1e-4 && this.duration === 1 && !this.longer;
      const found = this.recorded.find((one) => one.push === this.push);
      return home && found ? { samples: found.samples, fault: 0, fault_sample: -1 } : { missing: true };
    }
    if (this.motion.crossing.authority < model.min_authority[law]) return { refused: true };
    const mechanism = model.mechanism[this.longer + (model.mechanism.length - 1) / 2], actual = model.actual[this.longer + (model.actual.length - 1) / 2];
    const effects = this.push > 0 || this.longer !== 0;
    const robot = effects ? model.pushed(mechanism, this.push, this.motion.crossing.time - PUSH_TIME / 2) : null;
    const run = new model.PlayRun(model.control[law], actual, robot, model.rate_hz, model.steps, model.step, model.torque_limit, this.motion, []);
    return model.play((effects ? model.with_effects : model.ideal)[law], run, model.memory[law]);
  }

  judge(row, run) {
    const [, verdict, asked] = row.cells;
    const set = (text, css, torque = "") => { verdict.textContent = text; verdict.className = css; asked.textContent = torque; };
    if (!run) return set("", "");
    if (run.missing) return set("recorded from the start only", "note");
    if (run.refused) return set("refused: path not along tₛ", "bad");
    const error = Math.max(...run.samples.map((one) => one.error)), last = run.samples[run.samples.length - 1];
    const most = Math.max(...run.samples.flatMap((one) => [one.asked1, one.asked2]).filter(Number.isFinite).map(Math.abs));
    const torque = `${most >= 100 ? Math.round(most).toLocaleString("en") : most.toPrecision(2)} Nm`;
    if (run.fault) return set(`stopped: ${FAULTS[run.fault] || "a fault"}`, "bad", torque);
    if (last.determinant * run.samples[0].determinant > 0) return set("fell back", "bad", torque);
    set(`across, ${(1e3 * error).toFixed(error < 1e-3 ? 2 : 1)} mm off`, error <= model.tolerance ? "good" : "bad", torque);
  }

  cross() {
    const run = this.runs[this.law];
    if (!run || !run.samples) return;
    // one that is under way begins again
    cancelAnimationFrame(this.frame);
    this.playing = true;
    const begun = performance.now(), end = (run.samples.length - 1) / model.rate_hz;
    const frame = (now) => {
      if (!this.playing) return;
      const time = Math.min(end, SLOW * (now - begun) / 1e3);
      this.show(time);
      if (time < end) this.frame = requestAnimationFrame(frame);
      else this.playing = false;
    };
    this.frame = requestAnimationFrame(frame);
  }

  pause() {
    if (this.playing) this.playing = false;
    else this.cross();
  }

  // At a time of the chosen run, or, without one, at the platform's place before it.
  show(time) {
    this.time = time;
    const run = this.runs[this.law], samples = run && run.samples;
    const number = time === null || !samples ? null : Math.min(samples.length - 1, Math.round(time * model.rate_hz));
    const sample = number === null ? null : samples[number];
    const [x, y] = sample ? [sample.x, sample.y] : [this.x, this.y];
    const state = model.state_from_platform(model.robot, ...model.mode, x, y, 0, 0);
    const posture = sample || { x, y, q11: state.leg1.q1, q21: state.leg2.q1 };
    const trail = sample ? samples.slice(0, number + 1) : [];
    this.draw(state, posture, trail);
    this.tell(state, run, number);
    this.find("time").max = samples ? (samples.length - 1) / model.rate_hz : 1;
    this.find("time").value = time || 0;
    this.find("clock").textContent = `${(time || 0).toFixed(2)} s`;
    const shared = { end: this.duration, period: 1 / model.rate_hz, crossing: this.motion ? this.motion.crossing.time : Infinity, cursor: time };
    const column = (name) => (samples || []).map((one) => one[name]);
    this.torques.show({ ...shared, unit: "Nm", limit: model.torque_limit,
      lines: [{ values: column("asked1"), colour: "plus" }, { values: column("asked2"), colour: "minus" }] });
    this.errors.show({ ...shared, unit: "mm", limit: 1e3 * model.tolerance,
      lines: [{ values: column("error").map((value) => 1e3 * value), colour: "good" }] });
  }

  pushes() {
    return this.push > 0 && this.time !== null && Math.abs(this.time - this.motion.crossing.time) < PUSH_TIME / 2;
  }

  draw(state, posture, trail) {
    const mm = (point) => [1e3 * point[0], 1e3 * point[1]], mode = Math.sign(model.det_a(state)) || 1;
    const shown = { ...posture, x: 1e3 * posture.x, y: 1e3 * posture.y, mode };
    const other = mm(model.direct_geometry(model.robot, -mode, posture.q11, posture.q21));
    const pieces = [];
    for (const one of trail) extendTrail(pieces, Math.sign(one.determinant), mm([one.x, one.y]));
    const svd = model.parallel_svd(state), at = [shown.x, shown.y];
    const along = (size) => [at[0] + size * svd.t_x, at[1] + size * svd.t_y];
    const ellipse = Array.from({ length: 121 }, (_, number) => {
      const angle = 2 * Math.PI * number / 120;
      const [vx, vy] = model.platform_acceleration(state, Math.cos(angle), Math.sin(angle));
      return [at[0] + 250 * vx, at[1] + 250 * vy];
    }).filter((point) => point.every(Number.isFinite));
    const lines = [{ points: ellipse, colour: "good", width: 2 }, { points: [along(-34), along(34)], colour: "ink", width: 1.5 }];
    const end = along(34)[1] < this.data.scene.bounds[3] - 8 ? along(34) : along(-34);
    const labels = [{ point: end, text: "tₛ", shift: [8, 4] }];
    if (this.pushes()) {
      lines.push({ points: [along(-60), along(-12)], colour: "minus", width: 5 });
      labels.push({ point: along(-60), text: "push", shift: [10, 4] });
    }
    const goal = this.motion && mm([this.motion.segment.end_x, this.motion.segment.end_y]);
    if (goal) lines.unshift({ points: [mm([this.motion.segment.start_x, this.motion.segment.start_y]), goal], colour: "soft", width: 1.5, dash: [3, 5] });
    this.stage.over = { lines, labels, goal };
    const robots = [{ robot: this.data.robot, posture: shown, trail: pieces, plain: true }];
    if (other.every(Number.isFinite)) robots.push({ robot: this.data.robot, posture: { ...shown, x: other[0], y: other[1], mode: -mode }, second: true });
    this.stage.show(robots);
  }

  // The figures of a posture, and in a sentence what is to be seen.
  tell(state, run, number) {
    const determinant = model.det_a(state), svd = model.parallel_svd(state);
    const asked = model.inverse_dynamics_of_platform(model.robot, state, svd.t_x, svd.t_y, 0, 0);
    const most = Math.max(...asked.map(Math.abs));
    const bar = (name, share, over) => {
      this.find(`${name}-bar`).style.width = `${100 * Math.min(1, Math.max(0, share))}%`;
      this.find(`${name}-bar`).className = over ? "over" : "";
    };
    const near = svd.kappa < LITTLE_GRIP;
    this.find("det").textContent = `${determinant >= 0 ? "+" : "−"}${Math.abs(determinant).toFixed(3)}`;
    this.find("kappa").textContent = svd.kappa.toFixed(3);
    this.find("torque").textContent = Number.isFinite(most) ? `${most.toPrecision(3)} Nm` : "∞";
    bar("det", Math.abs(determinant), near);
    bar("kappa", svd.kappa, near);
    bar("torque", (Math.log10(most) + 3) / 6, !(most < model.torque_limit));
    const told = this.find("told"), title = LAWS.find(([law]) => law === this.law)[1];
    if (number !== null && run.fault && number >= run.fault_sample)
      told.textContent = `Stopped: ${title} ${run.fault === 10 ? "asked for more torque than there is" : "has lost the path"}. The brake holds the motors; the platform is on its own.`;
    else if (number !== null && number === run.samples.length - 1)
      told.textContent = "Across: the same motors, the other assembly mode.";
    else if (near) told.textContent = "Hardly any grip: along tₛ no torque of the motors moves the platform, nor holds it.";
    else if (!this.motion) told.textContent = "No straight way across from here. Drag the platform elsewhere.";
    else if (this.motion.crossing.distal_links === "folded")
      told.textContent = "Here the outer links fold onto each other: the elbows have to pass each other.";
    else told.textContent = `Assembly mode ${determinant > 0 ? "+" : "−"}. The grey robot has the same motor angles. Cross to get there.`;
  }
}

window.play = new Play(JSON.parse(document.getElementById("play-data").textContent));
