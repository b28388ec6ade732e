// SPDX-License-Identifier: Apache-2.0
// Charts over time with one time axis and one cursor, drawn by Bokeh.
"use strict";

const LINE_COLOURS = { first: "plus", second: "minus", third: "locus", fourth: "good", soft: "soft" };

class Charts {
  // `charts`: title, unit and lines of each; `sources`: columns of each run; `seek`: called with a time (s).
  constructor(holder, charts, sources, zones, faults, seek) {
    this.sources = sources.map((data) => new Bokeh.ColumnDataSource({ data }));
    this.range = new Bokeh.Range1d({ start: 0, end: 1 });
    this.dressed = [];
    this.cursors = [];
    this.plots = charts.map((chart) => this.build(chart, zones, faults, seek));
    DARK.addEventListener("change", () => this.dress());
    this.dress();
    this.shown = Bokeh.Plotting.show(this.plots, holder);
  }

  build(chart, zones, faults, seek) {
    const plot = Bokeh.Plotting.figure({
      height: 170, sizing_mode: "stretch_width", x_range: this.range,
      y_range: new Bokeh.DataRange1d({ min_interval: chart.least }), title: chart.title, toolbar_location: "right",
      tools: "xbox_zoom,box_zoom,xpan,xwheel_zoom,ywheel_zoom,reset", lod_threshold: null, min_border_left: 58,
    });
    plot.toolbar.setv({ logo: null });
    // all that is charted comes near zero; without one finite value, as on the live page at first, there is no range
    plot.scatter([0], [0], { size: 1 }).setv({ visible: false });
    const tips = chart.lines.map((line) => [line.label, `@{${line.column}}{0.000} ${chart.unit}`]);
    for (const [run, source] of this.sources.entries()) {
      let hovered = null;
      for (const line of chart.lines) {
        if (!source.data[line.column]) continue;
        const label = this.sources.length > 1 ? `${line.label}, run ${run + 1}` : line.label;
        const renderer = plot.line({ field: "time" }, { field: line.column }, {
          source, line_width: line.colour === "soft" ? 1 : 1.8, line_dash: run ? "dashed" : "solid",
          line_alpha: run ? 0.75 : 1, legend_label: label, line_join: "round",
        });
        this.dressed.push([renderer.glyph, "line_color", LINE_COLOURS[line.colour]]);
        hovered = hovered || renderer;
      }
      const name = this.sources.length > 1 ? `time, run ${run + 1}` : "time";
      if (hovered) plot.add_tools(new Bokeh.HoverTool({
        mode: "vline", renderers: [hovered], tooltips: [[name, "@time{0.0000} s"], ...tips], line_policy: "nearest" }));
    }
    for (const [left, right] of zones) {
      const box = new Bokeh.BoxAnnotation({ left, right, level: "underlay", line_color: null });
      plot.add_layout(box);
      this.dressed.push([box, "fill_color", "zone"], [box, "fill_alpha", "zoneAlpha"]);
    }
    for (const fault of faults) {
      const span = new Bokeh.Span({ dimension: "height", location: fault.time, line_dash: "dotted", line_width: 2 });
      plot.add_layout(span);
      this.dressed.push([span, "line_color", "minus"]);
    }
    const cursor = new Bokeh.Span({ dimension: "height", location: 0, line_width: 1.5, level: "overlay" });
    plot.add_layout(cursor);
    this.cursors.push(cursor);
    this.dressed.push([cursor, "line_color", "ink"]);
    if (seek) plot.on_event("tap", (event) => seek(event.x));
    return plot;
  }

  dress() {
    const tint = colours();
    for (const [model, property, name] of this.dressed) model.setv({ [property]: tint[name] });
    for (const plot of this.plots) {
      plot.setv({ background_fill_color: null, border_fill_color: null, outline_line_color: null });
      plot.title.setv({ text_color: tint.ink, text_font_size: "13px", text_font_style: "bold" });
      for (const axis of [...plot.below, ...plot.left].filter((each) => each instanceof Bokeh.LinearAxis))
        axis.setv({ axis_line_color: tint.line, major_tick_line_color: tint.line, minor_tick_line_color: null,
          major_label_text_color: tint.soft });
      for (const grid of plot.center.filter((each) => each instanceof Bokeh.Grid))
        grid.setv({ grid_line_color: tint.line, grid_line_alpha: 0.6 });
      for (const legend of plot.center.filter((each) => each instanceof Bokeh.Legend))
        legend.setv({ orientation: "horizontal", location: "top_right", background_fill_color: tint.card,
          background_fill_alpha: 0.6,
          border_line_color: null, label_text_color: tint.ink, label_text_font_size: "11px", padding: 0, margin: 0,
          spacing: 8, glyph_width: 14, click_policy: "hide" });
    }
  }

  span(start, end) {
    this.range.setv({ start, end, reset_start: start, reset_end: end });
  }

  at(time) {
    for (const cursor of this.cursors) cursor.setv({ location: time });
  }
}
