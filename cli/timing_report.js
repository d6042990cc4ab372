"use strict";
// Draws the report of a study of times from the data embedded in the page.
(() => {
  const { list, finite, number, plain, element, section, table } = page;
  const data = JSON.parse(document.getElementById("timing").textContent);
  const stages = list(data.stages), runs = list(data.runs);
  const colours = ["#0072b2", "#d55e00", "#007a5a", "#b0588f", "#8a6d00", "#2b2f33"];
  const whole = "total";

  Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
  Chart.defaults.font.size = 12.5;
  Chart.defaults.animation = false;
  Chart.defaults.maintainAspectRatio = false;

  const estimate = (found, digits = 3) => {
    if (!found || !finite(found.value)) return "–";
    const interval = list(found.interval_95);
    return number(found.value, digits) + (interval.length === 2 ? ` (${number(interval[0], digits)} to ${number(interval[1], digits)})` : "");
  };
  /** The interval of every point of a data set as a line with ends. */
  const whiskers = {
    id: "whiskers",
    afterDatasetsDraw(chart) {
      const { ctx, scales: { y } } = chart;
      chart.data.datasets.forEach((set, s) => chart.getDatasetMeta(s).data.forEach((mark, k) => {
        const interval = list(list(set.intervals)[k]);
        if (interval.length !== 2 || !finite(mark.x)) return;
        const [low, high] = interval.map((value) => y.getPixelForValue(value));
        ctx.save();
        ctx.strokeStyle = "#1d2329";
        ctx.lineWidth = 1.3;
        ctx.beginPath();
        for (const end of [low, high]) {
          ctx.moveTo(mark.x - 4, end);
          ctx.lineTo(mark.x + 4, end);
        }
        ctx.moveTo(mark.x, low);
        ctx.lineTo(mark.x, high);
        ctx.stroke();
        ctx.restore();
      }));
    },
  };
  const plot = (title, description, configuration) => {
    const canvas = element("canvas", { role: "img", "aria-label": description });
    const figure = element("figure", {}, element("figcaption", {}, title), element("div", { class: "plot" }, canvas));
    // A canvas has its size once it is part of the page.
    setTimeout(() => new Chart(canvas, { ...configuration, plugins: [whiskers] }));
    return figure;
  };
  /** Shorter stages have no place in a plot: what they gain does not matter, and their intervals are wide. */
  const least_share = 0.01;
  const bars = (title, unit, backend_rows, threads, value_of) => {
    const labels = [...new Set(backend_rows.filter((row) => row.share >= least_share).map((row) => row.stage))];
    const datasets = threads.map((count, k) => {
      const found = labels.map((stage) => value_of(backend_rows.find((row) => row.stage === stage && row.threads === count)));
      return {
        label: count + (count === 1 ? " thread" : " threads"),
        data: found.map((value) => (value ? value.value : null)),
        intervals: found.map((value) => (value ? value.interval_95 : null)),
        backgroundColor: colours[k % colours.length],
      };
    });
    const highest = Math.max(...datasets.flatMap((set) => set.intervals.map((interval) => (list(interval).length === 2 ? interval[1] : 0))));
    return plot(title, title, {
      type: "bar",
      data: { labels, datasets },
      options: { scales: { y: { beginAtZero: true, suggestedMax: highest, title: { display: unit !== "", text: unit } } } },
    });
  };

  const groups = new Map();
  for (const row of stages) {
    const key = row.backend + " " + row.scaling;
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(row);
  }

  const strong_whole = stages.filter((row) => row.stage === whole && row.scaling === "strong" && row.speed_up);
  document.getElementById("headline").textContent = strong_whole.length
    ? strong_whole.map((row) => `${row.backend}: ${row.threads} threads are ${estimate(row.speed_up)} times as fast.`).join(" ") +
      ` 95 % intervals of ${data.repeats} repeats. All results are the same to the last bit.`
    : `${data.repeats} repeats.`;

  if (list(data.warnings).length) {
    const warned = section("warnings", "Warnings", "Why these figures may not be trusted.");
    warned.append(element("ul", {}, ...data.warnings.map((text) => element("li", {}, text))));
  }
  for (const rows of groups.values()) {
    const { backend, scaling } = rows[0];
    const weak = scaling === "weak";
    const threads = [...new Set(rows.map((row) => row.threads))];
    const part = section(backend + "-" + scaling, backend + (weak ? ", patches in proportion to threads" : ""),
      weak ? "At best every time stays the same. Radiosity works with pairs of patches, so that its time grows with the patches even so."
        : "Medians; lines span 95 % confidence intervals. Processor time that stays the same while wall time does not shrink tells of serial code or of neighbours, one that grows tells of what threads cost.");
    const pair = element("div", { class: "two" });
    part.append(pair);
    pair.append(bars("Wall time by stage", "s", rows, threads, (row) => row && row.wall_s));
    const more = threads.filter((count) => rows.some((row) => row.threads === count && row.speed_up));
    if (more.length) pair.append(bars(weak ? "Time of the fewest threads over the time" : "Speed-up by stage", "", rows, more, (row) => row && row.speed_up));
    part.append(table("Figures", [
      { head: "stage" }, { head: "threads" }, { head: "share" }, { head: "wall time, s" }, { head: "CPU time, s" },
      { head: weak ? "efficiency" : "speed-up" }, { head: weak ? "" : "efficiency" }, { head: "CPU time beside fewest threads" },
      { head: weak ? "patches" : "serial fraction (Karp and Flatt)" }, { head: "per second" }, { head: "threads that worked" }, { head: "peak memory, MB" }],
    rows.map((row) => ({
      class: row.stage === whole ? "total" : undefined,
      cells: [row.stage, String(row.threads), number(100 * row.share) + " %", estimate(row.wall_s), estimate(row.cpu_s), estimate(row.speed_up),
        weak ? "" : estimate(row.efficiency), estimate(row.cpu_ratio), weak ? String(row.patches) : estimate(row.karp_flatt, 2),
        row.work_per_s ? estimate(row.work_per_s) + " " + row.work_unit : "", String(row.fewest_threads_that_worked),
        number(row.peak_memory_bytes / 1e6)],
    })), true));
    const serial = list(data.serial).filter((found) => found.backend === backend);
    if (!weak && serial.length) {
      part.append(table("Serial fraction by Amdahl's law", [{ head: "stage" }, { head: "serial fraction" }],
        serial.map((found) => ({ cells: [found.stage, estimate(found.serial_fraction, 2)] }))));
    }
  }

  const drift = section("runs", "Every run", "Wall time of whole runs in the order in which they were made, and what other processes took meanwhile.");
  const series = new Map();
  runs.forEach((run, k) => {
    const key = `${run.backend}, ${run.threads} ${run.scaling === "weak" ? "(weak)" : ""}`;
    if (!series.has(key)) series.set(key, []);
    series.get(key).push({ x: k + 1, y: list(run.stages).find((stage) => stage.stage === whole)?.wall_s });
  });
  drift.append(plot("Wall time of whole runs", "Wall time of whole runs in their order", {
    type: "line",
    data: { datasets: [...series].map(([label, points], k) => ({ label, data: points, borderColor: colours[k % colours.length], backgroundColor: colours[k % colours.length] })) },
    options: { scales: { x: { type: "linear", title: { display: true, text: "run" }, ticks: { precision: 0 } }, y: { beginAtZero: true, title: { display: true, text: "s" } } } },
  }));
  drift.append(table("Load", [{ head: "run" }, { head: "backend", words: true }, { head: "threads" }, { head: "repeat" }, { head: "others, %" }, { head: "host of the virtual machine, %" }],
    runs.map((run, k) => ({ cells: [String(k + 1), run.backend, String(run.threads), String(run.repeat),
      finite(run.others_share) ? number(100 * run.others_share) : "–", finite(run.stolen_share) ? number(100 * run.stolen_share) : "–"] })), true));

  const machine = section("machine", "Machine and program");
  const { software = {}, ...hardware } = data.machine || {};
  machine.append(table("Description", [{ head: "what" }, { head: "value", words: true }],
    [...Object.entries(hardware), ...Object.entries(software), ["scene SHA-256", data.scene?.sha256], ["command", data.command]].map(([name, value]) => ({
      cells: [name.replaceAll("_", " "), value === null || value === "" || value === undefined ? "not known" : finite(value) ? plain(value) : String(value)] }))));
})();
