"use strict";
// The plots over time, and the read-out of the residual picture. Everything else on the page is static.
(() => {
  const data = JSON.parse(document.getElementById("report-data").textContent);
  const root = document.documentElement;
  const facts = new Map(data.channels.map((channel) => [channel.name, channel]));
  const colour = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const PRINT_WIDTH = 680; // px, the text width of an A4 page

  const trialBox = document.getElementById("trial");
  const channelBox = document.getElementById("channel");
  const holders = ["plot-values", "plot-errors"].map((id) => document.getElementById(id));
  let plots = [];
  let window_ = null; // the time shown, [from, to], or null for all
  let printing = false;

  const brief = (value) => (value < 10 ? value.toFixed(1) : value.toFixed(0));
  const trial = () => data.trials[Number(trialBox.value)];

  // Root mean square of (predicted - measured) over what the noise and the instruments would leave, over a trial.
  function error(series, side) {
    let sum = 0;
    let count = 0;
    series.measured.forEach((value, i) => {
      if (value !== null && series[side][i] !== null) {
        sum += ((series[side][i] - value) / series.expected) ** 2;
        count += 1;
      }
    });
    return count ? Math.sqrt(sum / count) : 0;
  }

  function fillChannels() {
    const wanted = channelBox.value;
    const list = trial().series.map((series) => ({
      name: series.channel,
      before: error(series, "before"),
      after: error(series, "after"),
    }));
    channelBox.replaceChildren(
      ...list.map((entry) => {
        const option = document.createElement("option");
        option.value = entry.name;
        const change = (data.single ? "" : `${brief(entry.before)} → `) + brief(entry.after);
        option.textContent = `${facts.get(entry.name).label} (${change})`;
        return option;
      }),
    );
    const telling = list.reduce((a, b) => (b.before - b.after > a.before - a.after ? b : a), list[0]);
    channelBox.value = list.some((entry) => entry.name === wanted) ? wanted : telling?.name;
  }

  // Grey where the model disagrees; on the error plot also the band of pure noise.
  function shade(u, spans, band) {
    const { ctx } = u;
    const { left, top, width, height } = u.bbox;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    ctx.fillStyle = colour("shade");
    for (const [from, to] of spans) {
      const start = u.valToPos(from, "x", true);
      ctx.fillRect(start, top, u.valToPos(to, "x", true) - start, height);
    }
    if (band) {
      ctx.fillStyle = colour("band");
      const high = u.valToPos(2, "y", true);
      ctx.fillRect(left, high, width, u.valToPos(-2, "y", true) - high);
    }
    ctx.restore();
  }

  function axis(extra) {
    const font = "13px system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif";
    return {
      stroke: () => colour("soft"),
      grid: { stroke: () => colour("line"), width: 1 },
      ticks: { stroke: () => colour("line"), width: 1 },
      font,
      labelFont: font,
      values: (_, splits) => splits.map((value) => String(+value.toPrecision(10)).replace("-", "−")),
      ...extra,
    };
  }

  function options(width, height, label, unit, spans, band, series) {
    // Nothing where no time is pointed at, a dash where there is a gap.
    const told = (value, index, text) => (index === null ? "" : value === null || value === undefined ? "–" : text(value));
    const digits = (value, index) => told(value, index, (v) => v.toPrecision(6).replace("-", "−") + unit);
    return {
      width,
      height,
      scales: { x: { time: false } },
      cursor: { sync: { key: "time" }, drag: { x: true, y: false } },
      axes: [
        axis({ label: "time (s)", labelSize: 20, size: 36 }),
        axis({ label, labelSize: 20, size: width < 500 ? 56 : 66 }),
      ],
      series: [
        { label: "time", value: (_, value, __, index) => told(value, index, (v) => v.toFixed(2) + " s") },
        ...series.map((entry) => ({ value: (_, value, __, index) => digits(value, index), points: { show: false }, ...entry })),
      ],
      hooks: {
        drawClear: [(u) => shade(u, spans, band)],
        setScale: [(u, key) => key === "x" && follow(u)],
      },
    };
  }

  // Both plots show the same stretch of time.
  let following = false;
  function follow(source) {
    if (following || plots.length < 2) return;
    following = true;
    const { min, max } = source.scales.x;
    window_ = [min, max];
    for (const plot of plots) {
      if (plot !== source) plot.setScale("x", { min, max });
    }
    following = false;
  }

  function draw() {
    const current = trial();
    const series = current.series.find((entry) => entry.channel === channelBox.value);
    const { unit, label } = facts.get(series.channel);
    const suffix = unit && unit !== "1" ? ` ${unit}` : "";
    const width = printing ? PRINT_WIDTH : holders[0].clientWidth;
    const kept = window_;
    plots.forEach((plot) => plot.destroy());
    plots = [];
    const minus = (values) =>
      values.map((value, i) =>
        value === null || series.measured[i] === null ? null : (value - series.measured[i]) / series.expected,
      );
    const before = { label: "before", stroke: () => colour("before"), width: 2, dash: [7, 4] };
    const after = { label: data.single ? "model" : "after", stroke: () => colour("after"), width: 1.5 };
    const models = data.single ? [after] : [before, after];
    const predicted = data.single ? [series.after] : [series.before, series.after];
    const name = suffix ? `${label} (${unit})` : label;
    const made = [
      new uPlot(
        options(width, width < 500 ? 260 : 330, name, suffix, current.spans, false, [
          {
            label: "measured",
            stroke: () => colour("measured"),
            paths: () => null,
            points: { show: true, size: 5, width: 0, fill: () => colour("measured") },
          },
          ...models,
        ]),
        [current.time, series.measured, ...predicted],
        holders[0],
      ),
      new uPlot(
        options(width, width < 500 ? 190 : 220, "error / noise", "", current.spans, true, models),
        [current.time, ...predicted.map(minus)],
        holders[1],
      ),
    ];
    plots = made;
    if (kept) show(...kept);
  }

  function show(from, to) {
    const { time } = trial();
    const first = time[0];
    const last = time[time.length - 1];
    const length = Math.min(to - from, last - first);
    const start = Math.min(Math.max(from, first), last - length);
    plots[0].setScale("x", { min: start, max: start + length });
  }

  function zoom(how) {
    const { time } = trial();
    const [from, to] = window_ ?? [time[0], time[time.length - 1]];
    const middle = (from + to) / 2;
    const half = (to - from) / 2;
    if (how === "in") show(middle - half / 2, middle + half / 2);
    else if (how === "out") show(middle - half * 2, middle + half * 2);
    else if (how === "left") show(from - half, to - half);
    else if (how === "right") show(from + half, to + half);
    else show(time[0], time[time.length - 1]);
  }

  if (trialBox && data.trials.some((entry) => entry.series.length)) {
    const heldOut = data.trials.findIndex((entry) => entry.holdout && entry.series.length);
    trialBox.value = String(Math.max(heldOut, 0));
    fillChannels();
    draw();
    trialBox.addEventListener("change", () => {
      window_ = null;
      fillChannels();
      draw();
    });
    channelBox.addEventListener("change", draw);
    document.querySelectorAll("[data-zoom]").forEach((button) => {
      button.addEventListener("click", () => zoom(button.dataset.zoom));
    });
    let width = holders[0].clientWidth;
    new ResizeObserver(() => {
      if (!printing && holders[0].clientWidth !== width) {
        width = holders[0].clientWidth;
        draw();
      }
    }).observe(holders[0]);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  }

  // On paper: light colours, everything unfolded, plots as wide as the page.
  let folded = [];
  function toPaper() {
    if (printing) return;
    printing = true;
    root.classList.add("light");
    folded = [...document.querySelectorAll("details:not([open])")];
    folded.forEach((entry) => (entry.open = true));
    if (plots.length) draw();
  }
  function toScreen() {
    if (!printing) return;
    printing = false;
    root.classList.remove("light");
    folded.forEach((entry) => (entry.open = false));
    if (plots.length) draw();
  }
  addEventListener("beforeprint", toPaper);
  addEventListener("afterprint", toScreen);
  const paper = matchMedia("print");
  paper.addEventListener("change", (event) => (event.matches ? toPaper() : toScreen()));
  if (paper.matches) toPaper();

  // The number under the pointer in the residual picture.
  const readOut = document.getElementById("heat-value");
  document.querySelectorAll(".heat").forEach((figure) => {
    const { edges, rows } = data.trials[Number(figure.dataset.trial)];
    const box = figure.querySelector(".cellbox");
    box.addEventListener("pointermove", (event) => {
      const { left, top, width, height } = box.getBoundingClientRect();
      const row = rows[Math.min(rows.length - 1, Math.max(0, Math.floor(((event.clientY - top) / height) * rows.length)))];
      const time = edges[0] + ((event.clientX - left) / width) * (edges[edges.length - 1] - edges[0]);
      const block = Math.min(edges.length - 2, Math.max(0, edges.findIndex((edge) => edge > time) - 1));
      const value = row[figure.dataset.side][block];
      readOut.textContent =
        ` ${facts.get(row.channel).label}, ${edges[block].toPrecision(4)} to ${edges[block + 1].toPrecision(4)} s, ` +
        `${figure.dataset.side}: ${value === null ? "no data" : value}`;
    });
  });
})();
