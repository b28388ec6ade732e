// SPDX-License-Identifier: Apache-2.0
// Shows a running graph: samples and states come over a connection that also carries commands.
"use strict";

const WINDOW = 10, ROWS = 1500;

class Live {
  constructor(data) {
    this.find = (name) => document.getElementById(`live-${name}`);
    this.data = data;
    this.frames = 0;
    this.rows = null;
    this.trail = [];
    this.waiting = null;
    this.columns = ["time", ...data.charts.flatMap((chart) => chart.lines.map((line) => line.column))];
    this.scene = null;
    this.goal = null;
    this.plan = null;
    this.listen();
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/live${location.search}`);
    this.socket.onopen = () => this.say("connected: waiting for the graph");
    this.socket.onclose = () => {
      this.ended = true;
      if (!this.outcome) this.say(`${this.state ? this.state.text + ": " : ""}the page is no longer served`);
      for (const button of document.querySelectorAll("button")) button.disabled = true;
    };
    this.socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      for (const [kind, content] of Object.entries(message)) this[`on_${kind}`]?.(content, message);
    };
  }

  say(text) {
    this.find("status").textContent = text;
  }

  send(command, more = {}) {
    this.socket.send(JSON.stringify({ command, ...more }));
  }

  listen() {
    this.find("stop").addEventListener("click", () => this.send("emergency_stop"));
    this.find("reset").addEventListener("click", () => this.send("reset"));
    this.find("move").addEventListener("click", () => this.move());
    this.find("goal").addEventListener("submit", (event) => {
      event.preventDefault();
      this.ask();
    });
    this.find("stage").addEventListener("click", (event) => {
      if (!this.scene || this.find("goal").hidden) return;
      const [x, y] = this.stage.under(event);
      this.find("x").value = x.toFixed(1);
      this.find("y").value = y.toFixed(1);
      this.ask();
    });
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select")) return;
      if (event.key === "s" || event.key === "S") this.find("stop").click();
      if (event.key === "r" || event.key === "R") this.find("reset").click();
    });
  }

  // The goal of the form, m, as commands carry it.
  wanted() {
    return { x: Number(this.find("x").value) / 1000, y: Number(this.find("y").value) / 1000,
      assembly: Number(this.find("assembly").value) };
  }

  ask() {
    this.plan = null;
    this.find("move").disabled = true;
    this.find("answer").textContent = "planning";
    this.send("plan", this.wanted());
    this.draw();
  }

  move() {
    if (!this.plan) return;
    this.find("move").disabled = true;
    const { x, y, assembly } = this.plan.goal;
    this.send("move", { x, y, assembly });
  }

  on_scene(scene, message) {
    this.scene = scene;
    this.robot = message.robot;
    this.find("goal").hidden = !message.goals;
    if (this.stage) this.stage.scene = scene, this.stage.resize();
    else this.stage = new Stage(this.find("stage"), scene);
    this.say("the graph is there: waiting for samples");
  }

  // Charts begin with the first samples, from which they take their first ranges.
  buildCharts(first) {
    this.charts = new Charts(this.find("charts"), this.data.charts, [first], [], [], null);
    this.source = this.charts.sources[0];
  }

  on_restart() {
    this.trail = [];
    this.waiting = null;
    if (this.source) this.source.data = Object.fromEntries(this.columns.map((name) => [name, []]));
  }

  on_rows(rows) {
    this.frames += 1;
    if (!this.stage || !rows.time.length) return;
    this.rows = rows;
    const last = rows.time.length - 1;
    for (let row = 0; row <= last; row++) extendTrail(this.trail, rows.mode[row], [rows.x[row], rows.y[row]]);
    while (this.trail.length > 20 || (this.trail[0].points.length > 5000 && this.trail.length > 1)) this.trail.shift();
    if (this.trail[0].points.length > 10000) this.trail[0].points.splice(0, 5000);
    const fresh = Object.fromEntries(this.columns.map((name) => [name, rows[name].map((value) => value ?? NaN)]));
    this.waiting ??= Object.fromEntries(this.columns.map((name) => [name, []]));
    for (const name of this.columns) this.waiting[name].push(...fresh[name]);
    // charts are dear to paint: every third frame is enough for the eye
    if (this.frames % 3 === 0) this.paintCharts(rows.time[last]);
    this.posture = { x: rows.x[last], y: rows.y[last], q11: rows.q11[last], q21: rows.q21[last], mode: rows.mode[last] };
    const shown = (value, digits, unit) => (value === null ? "–" : `${value.toFixed(digits)} ${unit}`);
    this.find("values").textContent = [`${rows.time[last].toFixed(2)} s`, `x ${shown(this.posture.x, 2, "mm")}`,
      `y ${shown(this.posture.y, 2, "mm")}`, modeName(this.posture.mode), `σ ${shown(rows.sigma[last], 2, "")}`,
      `error ${shown(rows.error[last], 3, "mm")}`].join(" · ");
    this.draw();
  }

  paintCharts(now) {
    if (!this.charts) this.buildCharts(this.waiting);
    else this.source.stream(this.waiting, ROWS);
    this.waiting = null;
    this.charts.span(Math.max(0, now - WINDOW), Math.max(WINDOW, now));
    this.charts.at(now);
  }

  draw() {
    if (!this.posture) return;
    const marks = [];
    if (this.plan) marks.push({ point: this.millimetres(this.plan.goal), label: "goal", line: this.plan.way });
    else if (this.refused) marks.push({ point: this.millimetres(this.refused), label: "refused", bad: true });
    this.stage.show([{ robot: this.robot, posture: this.posture, trail: this.trail }], marks);
  }

  millimetres(goal) {
    return [1000 * goal.x, 1000 * goal.y];
  }

  on_plan(plan) {
    const good = !plan.refused, seconds = plan.durations.reduce((sum, each) => sum + each, 0);
    this.plan = good ? { goal: plan.goal, way: plan.waypoints.map(([x, y]) => [1000 * x, 1000 * y]) } : null;
    this.refused = good ? null : plan.goal;
    this.find("move").disabled = !good;
    this.find("answer").textContent = good
      ? `The motion takes ${seconds.toFixed(2)} s over ${plan.waypoints.length} places. Nothing has moved yet.`
      : `Refused: ${plan.refused}`;
    this.draw();
  }

  on_goal(goal) {
    const moving = `The robot is moving.${this.oddsOf(goal)}`;
    const state = { planning: "The graph plans the motion.", moving, arrived: "Arrived.",
      refused: `The graph refused: ${goal.reason}`, stopped: `Stopped: ${goal.reason}` }[goal.state];
    if (state) this.find("answer").textContent = state;
    if (goal.state === "arrived") this.plan = null;
  }

  // How likely the motion is to succeed, where the graph tells.
  oddsOf(goal) {
    if (!goal.odds) return "";
    const { unknown, successes, robots } = goal.odds;
    return unknown ? ` Its odds are not known: ${unknown}.` : ` In simulation ${successes} of ${robots} drawn robots succeed.`;
  }

  // Drives that are off have no fault: so they are before and after a run.
  levelOf(text) {
    return text === "ok" ? "ok" : text.startsWith("drives_off") ? "off" : "error";
  }

  // What the command that made the run says of it. Its report is kept here, since the server ends with the command.
  on_ended(end) {
    this.outcome = end.outcome;
    this.say(end.text);
    if (end.html === null) return;
    const link = this.find("report"), report = new Blob([end.html], { type: "text/html" });
    link.href = URL.createObjectURL(report);
    link.textContent = "the report of this run";
    this.find("end").hidden = false;
    this.find("place").textContent = end.report;
  }

  on_notice(notice) {
    this.find("notice").textContent = notice.text;
    this.find("notice").className = notice.good ? "clock good" : "clock bad";
  }

  on_states(states) {
    this.state = states.state;
    if (!this.outcome) this.say(states.state.text);
    this.find("faults").replaceChildren(...states.faults.map((fault) => {
      const box = document.createElement("div");
      box.className = "box";
      for (const text of [fault.meaning, fault.recovery, fault.text]) {
        const line = document.createElement("p");
        line.textContent = text;
        box.append(line);
      }
      return box;
    }));
    const own = [["safety", states.safety], ["drives", states.drives]].filter(([, text]) => text !== null)
      .map(([name, text]) => ({ name, level: this.levelOf(text), message: text.replace(/^drives_off: /, ""), age: null }));
    const body = this.find("nodes");
    body.replaceChildren();
    for (const node of [...own, ...states.nodes]) {
      const row = body.insertRow(), level = node.level;
      row.insertCell().textContent = node.name;
      const cell = row.insertCell();
      cell.className = node.message.length > 24 ? `level-${level} long` : `level-${level}`;
      cell.textContent = node.message === level || node.message === "ok" ? level : `${level}: ${node.message}`;
      row.insertCell().textContent = node.age === null ? "" : `${node.age.toFixed(1)} s`;
    }
  }
}

window.live = new Live(JSON.parse(document.getElementById("live-data").textContent));
