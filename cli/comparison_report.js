"use strict";
// Draws the report of a comparison from the data embedded in the page. Everything that stems from a scene enters the
// page as text, never as markup.
(() => {
  const {
    list, record, finite, number, signed, plain, with_unit, place_text, setting_text, element, svg, main, section, table, details,
    nothing, viridis, colour_of, round_up,
  } = page;
  const data = JSON.parse(document.getElementById("comparison").textContent);

  const components = list(data.components).length ? data.components : ["sky", "sun", "erc", "irc", "total"];
  const component_names = {
    sky: "sky (SC)", sun: "sun", erc: "outdoor surfaces (ERC)", irc: "interreflection (IRC)", total: "total",
  };
  const points = list(data.points);
  const ingredients = list(data.ingredients);
  const sets = list(data.sets).length ? data.sets.map((set) => set.id) : [...new Set(points.map((point) => point.set))];
  const members = new Map(sets.map((id) => [id, []]));
  points.forEach((point, index) => members.get(point.set)?.push(index));

  const point_count = (id) => members.get(id)?.length || list(data.sets).find((set) => set.id === id)?.points || 0;
  const largest_set = sets.reduce((a, b) => (members.get(b).length > members.get(a).length ? b : a), sets[0]);
  const state = { set: largest_set, component: components.includes("total") ? "total" : components[0], unit: "%", difference: "total" };

  // Plots

  const blue = "#0072b2", pale_blue = "#a9d0e8", vermilion = "#d55e00", ink = "#1d2329", soft = "#56606b", grid_line = "#e3e6ea";
  const series_colours = ["#0072b2", "#d55e00", "#007a5a", "#b0588f", "#8a6d00", "#2b2f33"];
  const series_marks = ["circle", "rectRot", "triangle", "rect", "rectRounded"];
  const charts = new Map();
  Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
  Chart.defaults.font.size = 12.5;
  Chart.defaults.color = soft;
  Chart.defaults.borderColor = grid_line;
  Chart.defaults.animation = false;
  Chart.defaults.maintainAspectRatio = false;

  /** A plot in its frame; draw() fills it. */
  const plot = (key, title, low) => {
    const caption = element("figcaption", {}, title);
    const canvas = element("canvas", { role: "img" });
    const figure = element("figure", {}, caption, element("div", { class: low ? "plot low" : "plot" }, canvas));
    return {
      figure,
      caption,
      draw(description, configuration) {
        canvas.setAttribute("aria-label", description);
        charts.get(key)?.destroy();
        charts.set(key, new Chart(canvas, configuration));
      },
    };
  };
  const stripes = (colour) => {
    const tile = element("canvas", { width: 6, height: 6 });
    const pen = tile.getContext("2d");
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, 6, 6);
    pen.strokeStyle = colour;
    pen.lineWidth = 1.4;
    pen.beginPath();
    for (const shift of [-6, 0, 6]) {
      pen.moveTo(shift, 6);
      pen.lineTo(shift + 6, 0);
    }
    pen.stroke();
    return pen.createPattern(tile, "repeat");
  };
  /** The error of the reference behind the bars: values from low to high along x. */
  const reference_band = (low, high) => ({
    id: "reference_band",
    beforeDatasetsDraw(chart) {
      if (!finite(low) || !finite(high)) return;
      const { ctx, chartArea: area, scales: { x } } = chart;
      const left = Math.max(area.left, x.getPixelForValue(low)), right = Math.min(area.right, x.getPixelForValue(high));
      ctx.save();
      ctx.fillStyle = "rgba(230, 159, 0, .28)";
      ctx.fillRect(left, area.top, Math.max(1.5, right - left), area.bottom - area.top);
      ctx.restore();
    },
  });
  const zero_line = {
    id: "zero_line",
    afterDatasetsDraw({ ctx, chartArea: area, scales: { x } }) {
      const at = x.getPixelForValue(0);
      if (at < area.left || at > area.right) return;
      ctx.save();
      ctx.strokeStyle = soft;
      ctx.beginPath();
      ctx.moveTo(at, area.top);
      ctx.lineTo(at, area.bottom);
      ctx.stroke();
      ctx.restore();
    },
  };

  // Values of the chosen set, component and unit

  const component_index = () => components.indexOf(state.component);
  const component_name = () => component_names[state.component] || state.component;
  const statistics = (source) => record(record(record(source)[state.set])[state.component]);
  const statistic = (source, name) => statistics(source)[name + (state.unit === "%" ? "_percent" : "_lx")];
  const unit_words = () => (state.unit === "%" ? "% of the mean reference" : "lx");
  const total_error = () => record(data.total).sets;
  const reference_error = () => record(data.reference_error).sets;
  const is_resolved = (ingredient) => {
    if (ingredient.resolved === false) return false;
    const told = record(ingredient.resolved_sets)[state.set];
    if (state.component === "total" && typeof told === "boolean") return told;
    const own = statistics(ingredient.sets).rms_lx, band = statistics(reference_error()).rms_lx;
    return !(finite(own) && finite(band)) || own > band;
  };

  const reference_at = (index) => list(points[index].reference)[component_index()];
  const method_at = (index) => list(points[index].method)[component_index()];
  const again_at = (index) => list(points[index].again)[component_index()];
  const minus = (a, b) => (finite(a) && finite(b) ? a - b : NaN);
  /** Differences, lx, that maps and histograms can show: [key, name, value of a point]. */
  const differences = () => {
    const found = [["total", "method − reference", (index) => minus(method_at(index), reference_at(index))]];
    if (points.some((point) => list(point.again).length))
      found.push(["again", "the reference's own: again − reference", (index) => minus(again_at(index), reference_at(index))]);
    if (state.component === "total")
      ingredients.forEach((ingredient, k) => {
        if (list(ingredient.total_lx).length) found.push(["sequence " + k, ingredient.name + ", in sequence", (index) => ingredient.total_lx[index]]);
        if (list(ingredient.alone_total_lx).length) found.push(["alone " + k, ingredient.name + ", alone", (index) => ingredient.alone_total_lx[index]]);
      });
    return found;
  };
  const chosen_difference = () => differences().find(([key]) => key === state.difference) || differences()[0];
  /** In the unit that is chosen; in per cent of the reference at the point. */
  const in_unit = (difference_lx, index) => {
    if (state.unit !== "%") return difference_lx;
    const reference = reference_at(index);
    return reference > 0 ? (100 * difference_lx) / reference : NaN;
  };

  const sorted = (values) => values.filter(finite).sort((a, b) => a - b);
  /** Linear between order statistics. */
  const quantile = (ordered, share) => {
    if (!ordered.length) return NaN;
    const at = share * (ordered.length - 1), below = Math.floor(at);
    return ordered[below] + (at - below) * ((ordered[below + 1] ?? ordered[below]) - ordered[below]);
  };
  // What is shown

  const choices = element("div", { class: "choices", role: "group", "aria-label": "What the figures below show" });
  const choose = (label, key, options) => {
    const select = element("select", {}, ...options.map(([value, name]) => element("option", { value }, name)));
    select.value = state[key];
    select.addEventListener("change", () => {
      state[key] = select.value;
      update();
    });
    return element("label", {}, element("span", { class: "long" }, label + " "), select);
  };
  if (sets.length > 1) choices.append(choose("Sensors", "set", sets.map((id) => [id, id])));
  choices.append(choose("Light", "component", components.map((name) => [name, component_names[name] || name])));
  choices.append(choose("Unit", "unit", [["%", "%"], ["lx", "lx"]]));
  for (const select of choices.querySelectorAll("select"))
    select.setAttribute("aria-label", select.parentElement.textContent.split(" ")[0]);
  main.append(choices);

  const updates = [];
  const update = () => updates.forEach((redraw) => redraw());

  // Total

  {
    const part = section("summary", "Total error");
    const words = element("p", { class: "note" });
    const tiles = element("dl", { class: "tiles" });
    part.append(words, tiles);
    updates.push(() => {
      const total = statistics(total_error()), reference = statistics(reference_error());
      const unit = state.unit === "%" ? "%" : "lx";
      const other = (name) => (state.unit === "%" ? with_unit(signed(total[name + "_lx"]), "lx") : with_unit(signed(total[name + "_percent"]), "%"));
      const tile = (name, value, below) => element("div", { class: "tile" }, element("dt", {}, name), element("dd", {}, value, element("small", {}, below || "\u00a0")));
      const worst = points.find((point) => point.id === total.worst_point);
      const resolved = !(finite(total.rms_lx) && finite(reference.rms_lx)) || total.rms_lx > reference.rms_lx;
      words.textContent = `Method minus reference at the ${point_count(state.set)} points of “${state.set}”, ${component_name()} light. ` +
        "Negative: the method is too dark. Per cent of the mean reference.";
      tiles.replaceChildren(
        tile("Mean", with_unit(signed(statistic(total_error(), "mean")), unit), other("mean")),
        tile("Root mean square", with_unit(number(statistic(total_error(), "rms")), unit), resolved ? other("rms").replace("+", "") : "not resolved by the reference"),
        tile("95 % of points within", with_unit(number(total.p95_lx), "lx")),
        tile("Worst place", with_unit(signed(total.worst_lx), "lx"), worst ? `${worst.id} (${place_text([worst.x, worst.y, worst.z])} m)` : total.worst_point),
        tile("The reference's own error", with_unit(number(statistic(reference_error(), "rms")), unit), "RMS against a second, independent way"));
    });
  }

  // Budget

  {
    const part = section("budget", "Budget: which ingredient costs what",
      "Starting from the reference, one ingredient after the other is replaced by that of the method. In sequence, the signed errors add up to the total; " +
      "alone, each is replaced by itself. The yellow band is the reference's own RMS error: striped bars are not above it and hence not resolved.");
    if (ingredients.length === 0) part.append(nothing("The comparison has no ingredients."));
    else {
      const mean_plot = plot("budget mean", "Signed mean"), rms_plot = plot("budget rms", "Root mean square");
      const frame = element("div", {});
      for (const { figure } of [mean_plot, rms_plot])
        figure.querySelector(".plot").style.height = `${Math.max(20, 6 + 2.1 * (ingredients.length + 1))}rem`;
      part.append(element("div", { class: "two" }, mean_plot.figure, rms_plot.figure), frame);
      const wrap = (text) => {
        const lines = [""];
        for (const word of text.split(" ")) {
          if (lines.at(-1) && (lines.at(-1) + " " + word).length > 16) lines.push(word);
          else lines[lines.length - 1] = (lines.at(-1) + " " + word).trim();
        }
        return lines;
      };
      updates.push(() => {
        const names = [...ingredients.map((ingredient) => ingredient.name), "total"];
        const shown = ingredients.map(is_resolved);
        const draw = (target, name, band) => {
          const in_sequence = [...ingredients.map((ingredient) => statistic(ingredient.sets, name)), statistic(total_error(), name)];
          const alone = [...ingredients.map((ingredient) => statistic(ingredient.alone_sets, name)), null];
          const datasets = [{
            label: "in sequence", data: in_sequence, borderColor: [...shown.map(() => blue), ink], borderWidth: 1,
            backgroundColor: [...shown.map((resolved) => (resolved ? blue : stripes(blue))), ink],
          }];
          if (alone.some(finite))
            datasets.push({ label: "alone", data: alone, backgroundColor: shown.map((resolved) => (resolved ? pale_blue : stripes("#7fb4d4"))), borderColor: blue, borderWidth: 1 });
          target.caption.replaceChildren(name === "mean" ? "Signed mean " : "Root mean square ", element("span", {}, unit_words()));
          target.draw(`Bars of the ${name === "mean" ? "signed mean" : "RMS"} error per ingredient: ` +
            names.map((label, k) => `${label} ${with_unit(signed(in_sequence[k]), state.unit)}`).join("; "), {
            type: "bar",
            data: { labels: names.map(wrap), datasets },
            options: {
              indexAxis: "y", barPercentage: 0.9, categoryPercentage: 0.78,
              scales: {
                x: { ticks: { callback: (value) => plain(value), maxTicksLimit: 7 } },
                y: { grid: { display: false }, ticks: { color: ink, autoSkip: false } },
              },
              plugins: {
                legend: { position: "bottom", labels: { boxWidth: 14, generateLabels: (chart) => [
                  ...chart.data.datasets.map((set, k) => ({ text: set.label, fillStyle: k ? pale_blue : blue, strokeStyle: blue, lineWidth: 1, fontColor: ink, datasetIndex: k, hidden: !chart.isDatasetVisible(k) })),
                  ...(shown.every(Boolean) ? [] : [{ text: "not resolved", fillStyle: stripes(blue), strokeStyle: blue, lineWidth: 1, fontColor: ink, datasetIndex: 0 }]),
                  { text: "reference's error", fillStyle: "rgba(230, 159, 0, .4)", lineWidth: 0, strokeStyle: "transparent", fontColor: ink, datasetIndex: 0 }] } },
                tooltip: { callbacks: { title: (items) => names[items[0].dataIndex], label: (item) => `${item.dataset.label}: ${with_unit(signed(item.raw), state.unit)}` } },
              },
            },
            plugins: [reference_band(name === "mean" && finite(band) ? -band : 0, band), zero_line],
          });
        };
        const band = statistic(reference_error(), "rms");
        draw(mean_plot, "mean", band);
        draw(rms_plot, "rms", band);
        const unit = state.unit === "%" ? "%" : "lx";
        const row = (name, group, replaces, resolved, source, alone, kind) => ({
          class: kind,
          cells: [resolved ? name : element("span", {}, name + " ", element("span", { class: "tag" }, "not resolved")), group, signed(statistic(source, "mean")), number(statistic(source, "rms")), number(statistics(source).p95_lx), signed(statistics(source).worst_lx),
            signed(statistic(alone, "mean")), number(statistic(alone, "rms")), replaces],
        });
        frame.replaceChildren(table(`Budget of “${state.set}”, ${component_name()}`, [
          { head: "Ingredient" }, { head: "Part of", words: true }, { head: `Mean, ${unit}` }, { head: `RMS, ${unit}` }, { head: "95 %, lx" }, { head: "Worst, lx" },
          { head: `Mean alone, ${unit}` }, { head: `RMS alone, ${unit}` }, { head: "What takes the place of what", words: true, long: true }],
        [...ingredients.map((ingredient, k) => row(ingredient.name, ingredient.group ?? "", ingredient.replaces ?? "", shown[k], ingredient.sets, ingredient.alone_sets, shown[k] ? undefined : "unresolved")),
          row("total", "", "method − reference", true, total_error(), undefined, "total"),
          row("reference's own error", "", "a second reference − reference", true, reference_error(), undefined)]));
      });
    }
  }

  // Maps

  // Blue to white to orange: told apart with any colour vision, and dark at both ends.
  const diverging = [[8, 64, 129], [44, 123, 182], [146, 197, 222], [247, 247, 245], [246, 177, 103], [222, 108, 18], [140, 52, 0]];

  /** The plane in which the points of a set are drawn: plan, or elevation where they stand above one another. */
  const layout = (set) => {
    const places = (members.get(set) || []).map((index) => [points[index].x, points[index].y, points[index].z]);
    const extent = (axis) => {
      const values = places.map((place) => place[axis]).filter(finite);
      return values.reduce((a, b) => Math.max(a, b), -Infinity) - values.reduce((a, b) => Math.min(a, b), Infinity);
    };
    const flat = (axis) => extent(axis) < 1e-3;
    const axes = !flat(2) && flat(1) ? [0, 2] : !flat(2) && flat(0) ? [1, 2] : [0, 1];
    const at = places.map((place) => [place[axes[0]], place[axes[1]]]);
    // On a regular grid the step of each axis; elsewhere the distance between neighbours.
    const steps = [0, 1].map((k) => {
      const values = [...new Set(at.map((place) => Math.round(1e4 * place[k])))].sort((a, b) => a - b);
      return { count: values.length, step: quantile(values.slice(1).map((value, n) => value - values[n]).sort((a, b) => a - b), 0.5) / 1e4 };
    });
    let cell = steps.map(({ step }) => step);
    if (at.length < 0.4 * steps[0].count * steps[1].count || !cell.every(finite)) {
      const nearest = at.slice(0, 500).map((a, k) => at.reduce((least, b, other) => {
        const distance = Math.hypot(a[0] - b[0], a[1] - b[1]);
        return other === k || distance < 1e-6 ? least : Math.min(least, distance);
      }, Infinity));
      const side = quantile(sorted(nearest), 0.5);
      cell = cell.map((step) => (at.length >= 0.4 * steps[0].count * steps[1].count && finite(step) ? step : finite(side) ? side : 0.5));
    }
    const ends = (k, take) => at.reduce((found, place) => take(found, place[k]), take === Math.min ? Infinity : -Infinity);
    const low = [0, 1].map((k) => ends(k, Math.min) - cell[k] / 2);
    const high = [0, 1].map((k) => ends(k, Math.max) + cell[k] / 2);
    return { axes, names: axes.map((axis) => "xyz"[axis]), at, cell, low, high, elevation: axes[1] === 2 };
  };
  const layouts = new Map();
  const layout_of = (set) => {
    if (!layouts.has(set)) layouts.set(set, layout(set));
    return layouts.get(set);
  };

  {
    const part = section("maps", "Where: maps in false colour",
      "Reference and method on one scale, and a signed difference: blue where the method is too dark, orange where it is too bright. " +
      "Point at a map, or give it the focus and move with the arrow keys, to read values. Numbers mark the worst places.");
    if (!points.length) part.append(nothing("The comparison has no points."));
    else {
      const select = element("select", { "aria-label": "Difference shown in the third map and the histogram" });
      select.addEventListener("change", () => {
        state.difference = select.value;
        update();
      });
      const choice = element("label", { class: "choice" }, "Difference ", select);
      part.append(choice);
      const make = () => {
        const canvas = element("canvas", { role: "img" });
        const caption = element("figcaption"), bar = element("div", { class: "bar" }), ticks = element("div", { class: "ticks", "aria-hidden": "true" });
        return { figure: element("figure", { class: "map" }, caption, canvas, bar, ticks), canvas, caption, bar, ticks };
      };
      const shown = [make(), make(), make()];
      const reading = element("p", { class: "reading", "aria-live": "polite" });
      const maps = element("div", { class: "maps", tabindex: "0", role: "application", "aria-label": "Maps: read the values of points with the arrow keys" }, ...shown.map((map) => map.figure));
      const worst_frame = element("div");
      part.append(maps, reading, worst_frame);
      let cursor = -1, view = { values: [], worst: [] };

      const absent = nothing("The comparison holds no single values of these points: the budget above is all there is.");
      part.append(absent);
      const paint = () => {
        const indices = members.get(state.set) || [];
        for (const piece of [maps, reading, worst_frame, choice]) piece.hidden = indices.length === 0;
        absent.hidden = indices.length > 0;
        if (!indices.length) return;
        const plane = layout_of(state.set);
        const size = [0, 1].map((k) => plane.high[k] - plane.low[k]);
        for (const [k, map] of shown.entries()) {
          const width = map.canvas.parentElement.clientWidth || 300, margin = 28;
          const scale = Math.min((width - margin - 4) / size[0], 420 / size[1]);
          const height = Math.ceil(size[1] * scale) + margin + 4, ratio = Math.max(2, window.devicePixelRatio || 1);
          map.canvas.width = width * ratio;
          map.canvas.height = height * ratio;
          map.canvas.style.height = height + "px";
          const pen = map.canvas.getContext("2d");
          pen.scale(ratio, ratio);
          const left = margin, top = 4;
          const to_paper = ([x, y]) => [left + (x - plane.low[0]) * scale, top + (plane.high[1] - y) * scale];
          map.to_plane = (x, y) => [plane.low[0] + (x - left) / scale, plane.high[1] - (y - top) / scale];
          pen.fillStyle = "#e9ebee";
          pen.fillRect(left, top, size[0] * scale, size[1] * scale);
          const [wide, tall] = plane.cell.map((metres) => metres * scale);
          indices.forEach((index, n) => {
            const value = view.values[k]?.[n];
            if (!finite(value)) return;
            const [x, y] = to_paper(plane.at[n]);
            pen.fillStyle = view.colour[k](value);
            // A little over the edge, or seams show between the cells.
            pen.fillRect(x - wide / 2, y - tall / 2, wide + 0.4, tall + 0.4);
          });
          pen.strokeStyle = soft;
          pen.lineWidth = 1;
          pen.strokeRect(left, top, size[0] * scale, size[1] * scale);
          pen.fillStyle = soft;
          pen.font = "11px " + Chart.defaults.font.family;
          pen.textBaseline = "top";
          const step = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500].find((metres) => metres * scale >= 34) || 1000;
          pen.textAlign = "center";
          for (let x = Math.ceil(plane.low[0] / step) * step; x <= plane.high[0]; x += step) {
            const [at] = to_paper([x, 0]);
            pen.fillRect(at - 0.5, top + size[1] * scale, 1, 4);
            if (at < width - 22) pen.fillText(plain(x), at, top + size[1] * scale + 6);
          }
          pen.textAlign = "right";
          pen.fillText(plane.names[0] + ", m", width - 2, top + size[1] * scale + 6);
          pen.textBaseline = "middle";
          for (let y = Math.ceil(plane.low[1] / step) * step; y <= plane.high[1]; y += step) {
            const [, at] = to_paper([0, y]);
            pen.fillRect(left - 4, at - 0.5, 4, 1);
            if (at > top + 14) pen.fillText(plain(y), left - 6, at);
          }
          pen.fillText(plane.names[1], left - 6, top + 5);
          const ring = (n, radius) => {
            const [x, y] = to_paper(plane.at[n]);
            pen.beginPath();
            pen.arc(x, y, radius, 0, 2 * Math.PI);
            return [x, y];
          };
          if (k === 2)
            view.worst.forEach((n, rank) => {
              const [x, y] = ring(n, 8);
              pen.fillStyle = "#fff";
              pen.fill();
              pen.strokeStyle = "#111";
              pen.lineWidth = 1.5;
              pen.stroke();
              pen.fillStyle = "#111";
              pen.textAlign = "center";
              pen.font = "bold 11px " + Chart.defaults.font.family;
              pen.fillText(rank + 1, x, y + 0.5);
            });
          if (cursor >= 0) {
            for (const [colour, thickness] of [["#fff", 5], ["#d10056", 2.5]]) {
              const [x, y] = to_paper(plane.at[cursor]);
              pen.strokeStyle = colour;
              pen.lineWidth = thickness;
              pen.strokeRect(x - wide / 2, y - tall / 2, wide, tall);
            }
          }
        }
      };
      const read = () => {
        const index = (members.get(state.set) || [])[cursor];
        if (index === undefined) {
          reading.textContent = "No point is chosen.";
          return;
        }
        const point = points[index], difference = chosen_difference(), value = difference[2](index), reference = reference_at(index);
        reading.textContent = `${point.id} at ${place_text([point.x, point.y, point.z])} m: reference ${with_unit(number(reference, 4), "lx")}, ` +
          `method ${with_unit(number(method_at(index), 4), "lx")}; ${difference[1]}: ${with_unit(signed(value), "lx")}` +
          (reference > 0 && finite(value) ? ` (${with_unit(signed((100 * value) / reference), "%")})` : "");
      };
      const move_to = (n) => {
        if (n === cursor) return;
        cursor = n;
        paint();
        read();
      };
      for (const map of shown) {
        const follow = (event) => {
          const box = map.canvas.getBoundingClientRect(), plane = layout_of(state.set);
          const [x, y] = map.to_plane(event.clientX - box.left, event.clientY - box.top);
          let best = -1, least = Math.max(...plane.cell);
          plane.at.forEach((place, n) => {
            const distance = Math.hypot(place[0] - x, place[1] - y);
            if (distance < least) [best, least] = [n, distance];
          });
          if (best >= 0) move_to(best);
        };
        map.canvas.addEventListener("pointermove", follow);
        map.canvas.addEventListener("pointerdown", follow);
      }
      maps.addEventListener("keydown", (event) => {
        const towards = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (!towards) return;
        event.preventDefault();
        const plane = layout_of(state.set);
        if (cursor < 0) return move_to(0);
        const from = plane.at[cursor];
        let best = -1, least = Infinity;
        plane.at.forEach((place, n) => {
          const along = (place[0] - from[0]) * towards[0] + (place[1] - from[1]) * towards[1];
          const across = Math.abs((place[0] - from[0]) * towards[1]) + Math.abs((place[1] - from[1]) * towards[0]);
          if (along > 1e-6 && along + 3 * across < least) [best, least] = [n, along + 3 * across];
        });
        if (best >= 0) move_to(best);
      });

      const show_ticks = (map, entries) =>
        map.ticks.replaceChildren(...entries.map(([place, text]) => element("span", { style: `left:${(100 * place).toFixed(2)}%` }, text)));
      const show_bar = (map, anchors) => {
        map.bar.style.background = `linear-gradient(to right, ${anchors.map((anchor) => `rgb(${anchor.join(",")})`).join(",")})`;
      };
      updates.push(() => {
        const options = differences();
        if (!options.some(([key]) => key === state.difference)) state.difference = "total";
        select.replaceChildren(...options.map(([value, name]) => element("option", { value }, name)));
        select.value = state.difference;
        const indices = members.get(state.set) || [], difference = chosen_difference();
        if (!indices.length) return paint();
        const reference = indices.map(reference_at), method = indices.map(method_at);
        const deltas_lx = indices.map(difference[2]), deltas = indices.map((index, n) => in_unit(deltas_lx[n], index));
        const levels = sorted([...reference, ...method]), largest = round_up(levels.at(-1) || 0);
        // Sun beside shade, or a window: a linear scale would show the brightest place alone.
        const logarithmic = levels.at(-1) > 8 * Math.max(quantile(levels, 0.5), 1e-9) && quantile(levels, 0.5) > 0;
        const decades = Math.min(3, Math.max(1, Math.ceil(Math.log10(largest / (levels.find((value) => value > 0) || largest)) - 1e-9)));
        const place = (value) => (logarithmic ? (value > 0 ? 1 + Math.log10(value / largest) / decades : 0) : value / largest);
        const sizes = sorted(deltas.map(Math.abs));
        const beyond = sizes.length > 0 && sizes.at(-1) > 5 * quantile(sizes, 0.95) && quantile(sizes, 0.95) > 0;
        const limit = round_up(beyond ? quantile(sizes, 0.95) : sizes.at(-1) || 0);
        const level_colour = (value) => colour_of(viridis, place(value));
        view = {
          values: [reference, method, deltas],
          colour: [level_colour, level_colour, (value) => colour_of(diverging, 0.5 + value / (2 * limit))],
          worst: deltas_lx.map((_, n) => n).filter((n) => finite(deltas_lx[n]) && deltas_lx[n] !== 0)
            .sort((a, b) => Math.abs(deltas_lx[b]) - Math.abs(deltas_lx[a])).slice(0, 5),
        };
        const plane = layout_of(state.set);
        const titles = ["Reference", "Method", "Difference"];
        const details_of = [`lx${logarithmic ? ", logarithmic" : ""}`, `lx${logarithmic ? ", logarithmic" : ""}`,
          `${difference[1]}, ${state.unit === "%" ? "% of the reference" : "lx"}${beyond ? "; worst beyond the scale" : ""}`];
        shown.forEach((map, k) => {
          map.caption.replaceChildren(titles[k] + " ", element("span", {}, details_of[k]));
          map.canvas.setAttribute("aria-label", `${titles[k]} of “${state.set}”, ${component_name()}, in ${plane.elevation ? "elevation" : "plan"}; the table of data holds the same values`);
          show_bar(map, k < 2 ? viridis : diverging);
          show_ticks(map, k < 2
            ? (logarithmic ? Array.from({ length: decades + 1 }, (_, n) => [n / decades, plain(largest * 10 ** (n - decades))]) : [0, 0.25, 0.5, 0.75, 1].map((at) => [at, plain(at * largest)]))
            : [-1, -0.5, 0, 0.5, 1].map((at) => [0.5 + at / 2, (at > 0 ? "+" : at < 0 ? "−" : "") + plain(Math.abs(at * limit))]));
        });
        if (cursor >= indices.length || cursor < 0) cursor = view.worst[0] ?? (indices.length ? 0 : -1);
        paint();
        read();
        const largest_share = (index) => {
          const shares = ingredients.map((ingredient) => list(ingredient.total_lx)[index]);
          let best = -1;
          shares.forEach((share, k) => {
            if (finite(share) && (best < 0 || Math.abs(share) > Math.abs(shares[best]))) best = k;
          });
          return best < 0 ? "–" : `${ingredients[best].name} (${with_unit(signed(shares[best]), "lx")})`;
        };
        const with_shares = state.component === "total";
        worst_frame.replaceChildren(table(`Worst places: ${difference[1]}, ${component_name()}`,
          [{ head: "Place" }, { head: "x, y, z, m" }, { head: "Reference, lx" }, { head: "Method, lx" }, { head: "Difference, lx" }, { head: "% of reference" },
            ...(with_shares ? [{ head: "Largest ingredient there", words: true, long: true }] : [])],
          view.worst.map((n, rank) => {
            const index = indices[n];
            return { cells: [`${rank + 1}: ${points[index].id}`, place_text([points[index].x, points[index].y, points[index].z]), number(reference[n], 4), number(method[n], 4), signed(deltas_lx[n]),
              reference[n] > 0 ? signed((100 * deltas_lx[n]) / reference[n]) : "–", ...(with_shares ? [largest_share(index)] : [])] };
          })));
      });
      let waiting = 0;
      new ResizeObserver(() => {
        cancelAnimationFrame(waiting);
        waiting = requestAnimationFrame(paint);
      }).observe(maps);
    }
  }

  // Histogram

  if (points.length) {
    const part = section("distribution", "How the error is distributed");
    const histogram = plot("histogram", "Histogram", true), frame = element("div");
    part.append(element("div", { class: "two" }, histogram.figure, frame));
    updates.push(() => {
      const indices = members.get(state.set) || [], difference = chosen_difference();
      part.hidden = indices.length === 0;
      if (part.hidden) return;
      const ordered = sorted(indices.map((index) => in_unit(difference[2](index), index)));
      const sizes = sorted(ordered.map(Math.abs));
      const unit = state.unit === "%" ? "% of the reference at the point" : "lx";
      frame.replaceChildren(table(`Quantiles: ${difference[1]}, ${unit}`, [{ head: "Share of points" }, { head: "Signed, below" }, { head: "Size, below" }],
        [0, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 1].map((share) => ({
          cells: [share === 0 ? "least" : share === 1 ? "largest" : share === 0.5 ? "50 % (median)" : `${Math.round(100 * share)} %`, signed(quantile(ordered, share)), number(quantile(sizes, share))],
        }))));
      const low = ordered[0] ?? 0, high = ordered.at(-1) ?? 0;
      const wanted = Math.min(31, Math.max(9, Math.ceil(2 * Math.cbrt(ordered.length)) + 4));
      const step = high > low ? round_up((high - low) / wanted) : 1;
      const first = Math.floor(low / step), counts = new Array(Math.floor(high / step) - first + 1).fill(0);
      ordered.forEach((value) => { counts[Math.floor(value / step) - first] += 1; });
      const centres = counts.map((_, k) => (first + k + 0.5) * step);
      histogram.caption.replaceChildren("Histogram ", element("span", {}, `${difference[1]}, ${unit}`));
      histogram.draw(`Histogram of ${ordered.length} points; the table beside it holds the quantiles`, {
        type: "bar",
        data: { datasets: [{ data: counts.map((count, k) => ({ x: centres[k], y: count })), backgroundColor: centres.map((value) => (value < 0 ? blue : "#e08214")), borderColor: "#fff", borderWidth: 0.5, barPercentage: 1, categoryPercentage: 1 }] },
        options: {
          scales: {
            x: { type: "linear", offset: false, min: first * step, max: (first + counts.length) * step, grid: { offset: false }, ticks: { callback: (value) => plain(value), maxTicksLimit: 9, includeBounds: false }, title: { display: true, text: state.unit === "%" ? "%" : "lx" } },
            y: { title: { display: true, text: "points" }, ticks: { precision: 0 } },
          },
          plugins: {
            legend: { display: false },
            tooltip: { callbacks: { title: (items) => `${signed(items[0].raw.x - step / 2)} to ${signed(items[0].raw.x + step / 2)}`, label: (item) => `${item.raw.y} points` } },
          },
        },
        plugins: [zero_line],
      });
    });
  }

  // Form factors and exitance

  const factors = record(data.form_factors), exitance = record(data.exitance);
  if (Object.keys(factors).length || Object.keys(exitance).length) {
    const part = section("form-factors", "Form factors and exitance",
      "The row sum of a patch in a closed room is 1; light through windows and what the projection leaves out is missing. The reciprocity gap is how far AᵢFᵢⱼ and AⱼFⱼᵢ differ.");
    const row_sums = record(factors.row_sums), gap = record(factors.reciprocity_gap);
    const sums = (name) => record(row_sums[name]);
    const ways = ["reference", "again", "method"].filter((way) => Object.keys(sums(way)).length || finite(gap[way]));
    const lines = ["mean", "min", "max"].filter((name) => ways.some((way) => finite(sums(way)[name])))
      .map((name) => ({ cells: [`Row sum, ${{ mean: "mean", min: "least", max: "largest" }[name]}`, ...ways.map((way) => number(sums(way)[name], 5))] }));
    if (ways.some((way) => finite(gap[way]))) lines.push({ cells: ["Reciprocity gap", ...ways.map((way) => number(gap[way]))] });
    const two = element("div", { class: "two" });
    if (lines.length) two.append(table("Quality of the form factors", [{ head: "Figure" }, ...ways.map((way) => ({ head: { reference: "Reference", again: "Reference again", method: "Method" }[way] }))], lines));
    const differences_of = [["Form factors, RMS", number(factors.rms)],
      ["Form factors, RMS weighted by the light they carry", number(factors.weighted_rms)],
      ["Share of the light exchanged that goes astray", with_unit(number(100 * factors.weighted_size), "%")],
      ["Light exchanged, too much or too little", with_unit(signed(100 * factors.weighted_mean), "%")],
      ["Exitance of patches, mean", with_unit(signed(exitance.mean_percent), "%")],
      ["Exitance of patches, RMS", with_unit(number(exitance.rms_percent), "%")],
      ["Exitance of patches, worst", with_unit(signed(exitance.worst_percent), "%")]].filter(([, text]) => text !== "–");
    if (differences_of.length) two.append(table("Method minus reference", [{ head: "Figure" }, { head: "Difference" }], differences_of.map((cells) => ({ cells }))));
    part.append(two);
    const pairs = list(factors.worst_pairs);
    if (pairs.length) {
      const flux = pairs.some((pair) => finite(pair.flux_lm));
      part.append(table("Worst pairs of patches", [{ head: "Pair" }, { head: "From patch", words: true }, { head: "at, m" }, { head: "To patch", words: true }, { head: "at, m" }, { head: "Reference" }, { head: "Method" }, { head: "Difference" }, { head: "%" }, ...(flux ? [{ head: "Light, lm" }] : [])],
        pairs.map((pair, k) => ({ cells: [`${k + 1}`, `${pair.from_face ?? ""} #${pair.from}`, place_text(pair.from_m), `${pair.to_face ?? ""} #${pair.to}`, place_text(pair.to_m),
          number(pair.reference), number(pair.method), signed(minus(pair.method, pair.reference)), pair.reference > 0 ? signed((100 * minus(pair.method, pair.reference)) / pair.reference) : "–", ...(flux ? [signed(pair.flux_lm)] : [])] }))));
      const ends = pairs.filter((pair) => list(pair.from_m).length > 1 && list(pair.to_m).length > 1);
      if (ends.length) {
        const all = [...ends.flatMap((pair) => [pair.from_m, pair.to_m]), ...points.map((point) => [point.x, point.y])].filter(([x, y]) => finite(x) && finite(y));
        const low = [0, 1].map((k) => Math.min(...all.map((place) => place[k]))), high = [0, 1].map((k) => Math.max(...all.map((place) => place[k])));
        const span = Math.max(high[0] - low[0], high[1] - low[1], 0.1), unit = span / 100, pad = 6 * unit;
        const at = (place) => [place[0] - low[0] + pad, high[1] - place[1] + pad];
        const drawing = svg("svg", { class: "plan", viewBox: `0 0 ${high[0] - low[0] + 2 * pad} ${high[1] - low[1] + 2 * pad}`, role: "img", "aria-label": "Plan of the worst pairs; the table above holds their places" });
        drawing.append(svg("rect", { x: 0.3 * pad, y: 0.3 * pad, width: high[0] - low[0] + 1.4 * pad, height: high[1] - low[1] + 1.4 * pad, fill: "#fafbfc", stroke: "#9aa5b1", "stroke-width": 0.3 * unit }));
        for (const point of points) if (finite(point.x) && finite(point.y)) {
          const [x, y] = at([point.x, point.y]);
          drawing.append(svg("circle", { cx: x, cy: y, r: 0.35 * unit, fill: "#aab3bd" }));
        }
        ends.forEach((pair) => {
          const [x1, y1] = at(pair.from_m), [x2, y2] = at(pair.to_m), too_dark = pair.method < pair.reference;
          drawing.append(svg("line", { x1, y1, x2, y2, stroke: too_dark ? blue : vermilion, "stroke-width": 0.55 * unit, "stroke-dasharray": too_dark ? "none" : `${2 * unit} ${unit}` }),
            svg("circle", { cx: x2, cy: y2, r: 0.9 * unit, fill: "#fff", stroke: too_dark ? blue : vermilion, "stroke-width": 0.5 * unit }));
        });
        ends.forEach((pair) => {
          const [x, y] = at(pair.from_m), too_dark = pair.method < pair.reference;
          drawing.append(svg("circle", { cx: x, cy: y, r: 2 * unit, fill: too_dark ? blue : vermilion, stroke: "#fff", "stroke-width": 0.3 * unit }),
            svg("text", { x, y: y + 0.85 * unit, "font-size": 2.4 * unit, "font-weight": "bold", fill: "#fff", "text-anchor": "middle" }, String(pairs.indexOf(pair) + 1)));
        });
        part.append(element("figure", {}, element("figcaption", {}, "Worst pairs in plan ", element("span", {}, "numbered at the patch that sends; solid blue: the method's form factor is too small, dashed orange: too large; small dots: sensors")), drawing));
      }
    }
  }

  // Convergence

  const sweeps = list(data.sweeps).filter((sweep) => list(sweep.points).length);
  if (sweeps.length) {
    const part = section("convergence", "Convergence: error against cost",
      "One setting is varied at a time, all else as in the method; both axes are logarithmic. Large marks with a dark ring are on the Pareto front: nothing tried is both quicker and better. Whiskers: spread of the time measured.");
    const whiskers = {
      id: "whiskers",
      beforeDatasetsDraw({ ctx, data: { datasets }, scales: { x, y }, chartArea: area }) {
        ctx.save();
        ctx.beginPath();
        ctx.rect(area.left, area.top, area.right - area.left, area.bottom - area.top);
        ctx.clip();
        for (const set of datasets) {
          ctx.strokeStyle = set.borderColor;
          ctx.lineWidth = 1;
          for (const spot of set.data) {
            if (!(spot.low > 0) || !(spot.high > 0)) continue;
            const [left, right, at] = [x.getPixelForValue(spot.low), x.getPixelForValue(spot.high), y.getPixelForValue(spot.y)];
            ctx.beginPath();
            ctx.moveTo(left, at);
            ctx.lineTo(right, at);
            for (const end of [left, right]) {
              ctx.moveTo(end, at - 4);
              ctx.lineTo(end, at + 4);
            }
            ctx.stroke();
          }
        }
        ctx.restore();
      },
    };
    const log_axis = (title, values) => {
      const positive = values.filter((value) => value > 0);
      const low = Math.min(...positive), high = Math.max(...positive), room = Math.max((high / low) ** 0.06, 1.08);
      const narrow = high / low < 12;
      return {
        type: "logarithmic", min: low / room, max: high * room, title: { display: true, text: title, color: ink },
        ticks: { maxRotation: 0, autoSkip: false, callback: (value) => {
          const digit = Math.round(value / 10 ** Math.floor(Math.log10(value) + 1e-9));
          if (Math.abs(value / 10 ** Math.floor(Math.log10(value) + 1e-9) - digit) > 1e-6) return "";
          return digit === 1 || digit === 10 || ((narrow || high / low < 300) && (digit === 2 || digit === 5)) || (narrow && digit === 3) ? plain(value) : "";
        } },
      };
    };
    const name_of = (sweep) => sweep.parameter + (sweep.unit ? `, ${sweep.unit}` : "");
    const label_of = (spot) => (typeof spot.label === "string" && spot.label !== "" ? spot.label : plain(spot.value));
    /** Settings that are words, as the spacing of cells. */
    const in_words = (sweep) => sweep.points.some((spot) => typeof spot.label === "string" && !/^[-+]?[0-9.]/.test(spot.label));
    const usable = (spot, abscissa) => spot[abscissa] > 0 && spot.rms_percent > 0;
    const cost = plot("cost", "All sweeps: error against time");
    part.append(cost.figure);
    const timed = sweeps.map((sweep) => sweep.points.filter((spot) => usable(spot, "seconds")));
    const flat = timed.flat();
    if (flat.length)
      cost.draw("Error against time for every sweep; the tables below hold the values", {
        type: "scatter",
        data: { datasets: sweeps.map((sweep, k) => ({
          label: sweep.parameter, showLine: !in_words(sweep), borderColor: series_colours[k % 6], borderWidth: 1.2,
          pointStyle: series_marks[k % 5], pointBackgroundColor: series_colours[k % 6],
          pointBorderColor: timed[k].map((spot) => (spot.pareto ? "#111" : series_colours[k % 6])), pointBorderWidth: timed[k].map((spot) => (spot.pareto ? 2 : 1)),
          pointRadius: timed[k].map((spot) => (spot.pareto ? 7 : 4)), pointHoverRadius: 8,
          data: timed[k].slice().map((spot) => ({ x: spot.seconds, y: spot.rms_percent, low: spot.seconds_low, high: spot.seconds_high, spot })),
        })) },
        options: {
          scales: { x: log_axis("time, s", flat.flatMap((spot) => [spot.seconds, spot.seconds_low, spot.seconds_high].filter(finite))), y: log_axis("RMS error, %", flat.map((spot) => spot.rms_percent)) },
          plugins: {
            legend: { position: "bottom", labels: { usePointStyle: true, color: ink } },
            tooltip: { callbacks: { label: (item) => `${item.dataset.label} ${label_of(item.raw.spot)}: ${number(item.raw.y)} % in ${number(item.raw.x)} s${item.raw.spot.pareto ? ", Pareto front" : ""}` } },
          },
        },
        plugins: [whiskers],
      });
    else cost.figure.replaceWith(nothing("No times were measured."));
    const grid = element("div", { class: "two" });
    part.append(grid);
    sweeps.forEach((sweep, k) => {
      const spots = sweep.points.filter((spot) => usable(spot, "value"));
      const target = plot("sweep " + k, sweep.parameter, true);
      const power = (value) => value.toFixed(2).replace("-", "−");
      const slope = !finite(sweep.slope) ? "no slope" : `slope ${power(sweep.slope)}` +
        (finite(sweep.slope_low) && finite(sweep.slope_high) ? ` (95 %: ${power(sweep.slope_low)} to ${power(sweep.slope_high)})` : "");
      target.caption.replaceChildren(name_of(sweep) + " ", element("span", {}, slope));
      grid.append(target.figure);
      if (in_words(sweep)) {
        const bars = (name, colour) => ({ label: name === "rms_percent" ? "RMS" : "95 % of points within", data: sweep.points.map((spot) => spot[name]), backgroundColor: colour });
        target.caption.replaceChildren(name_of(sweep));
        target.draw(`Error by ${name_of(sweep)}. ${sweep.points.map((spot) => `${label_of(spot)}: ${number(spot.rms_percent)} %`).join("; ")}`, {
          type: "bar",
          data: { labels: sweep.points.map((spot) => label_of(spot).replaceAll("_", " ")), datasets: [bars("rms_percent", blue), bars("p95_percent", vermilion)] },
          options: {
            indexAxis: "y",
            scales: { x: { beginAtZero: true, title: { display: true, text: "error, %", color: ink }, ticks: { callback: (value) => plain(value) } }, y: { grid: { display: false }, ticks: { color: ink } } },
            plugins: { legend: { position: "bottom", labels: { color: ink, boxWidth: 14 } }, tooltip: { callbacks: { label: (item) => `${item.dataset.label}: ${number(item.raw)} %` } } },
          },
        });
        return;
      }
      if (!spots.length) return target.figure.append(nothing("No point can be drawn on logarithmic axes."));
      const mean = (values) => values.reduce((sum, value) => sum + Math.log10(value), 0) / values.length;
      const datasets = [
        { label: "RMS", data: spots.map((spot) => ({ x: spot.value, y: spot.rms_percent, spot })), showLine: true, borderColor: blue, backgroundColor: blue, borderWidth: 1.5, pointBackgroundColor: blue,
          pointBorderColor: spots.map((spot) => (spot.pareto ? "#111" : blue)), pointBorderWidth: spots.map((spot) => (spot.pareto ? 2 : 1)), pointRadius: spots.map((spot) => (spot.pareto ? 6.5 : 4)) },
        { label: "95 % of points within", data: spots.filter((spot) => spot.p95_percent > 0).map((spot) => ({ x: spot.value, y: spot.p95_percent, spot })), showLine: true, borderColor: vermilion, backgroundColor: vermilion, borderWidth: 1.2, pointStyle: "triangle", pointRadius: 4.5 },
      ];
      if (finite(sweep.slope) && spots.length > 1) {
        const [x0, y0] = [mean(spots.map((spot) => spot.value)), mean(spots.map((spot) => spot.rms_percent))];
        const ends = [Math.min(...spots.map((spot) => spot.value)), Math.max(...spots.map((spot) => spot.value))];
        datasets.push({ label: "fitted slope", data: ends.map((x) => ({ x, y: 10 ** (y0 + sweep.slope * (Math.log10(x) - x0)) })), showLine: true, borderColor: soft, backgroundColor: soft, borderDash: [5, 4], borderWidth: 1.2, pointRadius: 0, pointStyle: "line" });
      }
      target.draw(`Error against ${name_of(sweep)}: ${slope}. ${spots.map((spot) => `${plain(spot.value)}: ${number(spot.rms_percent)} %`).join("; ")}`, {
        type: "scatter",
        data: { datasets },
        options: {
          scales: { x: log_axis(name_of(sweep), spots.map((spot) => spot.value)), y: log_axis("error, %", datasets.flatMap((set) => set.data.map((spot) => spot.y))) },
          plugins: {
            legend: { position: "bottom", labels: { usePointStyle: true, color: ink, boxWidth: 20 } },
            tooltip: { filter: (item) => item.raw.spot, callbacks: { label: (item) => `${plain(item.raw.x)}: ${item.dataset.label} ${number(item.raw.y)} %` } },
          },
        },
      });
    });
    part.append(details("Values of the sweeps", ...sweeps.map((sweep) => table(name_of(sweep), [{ head: sweep.parameter }, { head: "RMS, %" }, { head: "95 %, %" }, { head: "Time, s" }, { head: "from" }, { head: "to" }, { head: "Pareto front" }],
      sweep.points.map((spot) => ({ cells: [label_of(spot), number(spot.rms_percent), number(spot.p95_percent), number(spot.seconds), number(spot.seconds_low), number(spot.seconds_high), spot.pareto ? "yes" : "no"] }))))));
  }

  // Pictures

  if (list(data.pictures).length)
    section("pictures", "Colour difference of the pictures", "CIEDE2000 between the pictures of method and reference, per pixel. 1 is about what is just seen when two colours touch.")
      .append(table("CIEDE2000 per view", [{ head: "View" }, { head: "Mean" }, { head: "95 % of pixels within" }, { head: "Worst pixel" }],
        data.pictures.map((picture) => ({ cells: [String(picture.view), number(picture.mean), number(picture.p95), number(picture.worst)] }))));

  // Settings

  {
    const part = section("settings", "Settings, machine and provenance");
    const settings = record(data.settings), columns = ["method", "reference", "again"].filter((name) => Object.keys(record(settings[name])).length);
    const keys = [...new Set(columns.flatMap((name) => Object.keys(settings[name])))];
    const scene = record(data.scene), machine = record(data.machine);
    const facts = [["Scene", scene.name], ["File", scene.file], ["SHA-256 of the file", scene.sha256], ["naturel", data.naturel],
      ["Outdoor horizontal illuminance", finite(data.outdoor_horizontal_illuminance_lx) ? with_unit(number(data.outdoor_horizontal_illuminance_lx, 4), "lx") : undefined],
      ["Processor", machine.cpu], ["Cores, threads used", finite(machine.cores) || finite(machine.threads) ? `${machine.cores ?? "–"}, ${machine.threads ?? "–"}` : undefined]].filter(([, value]) => value !== undefined && value !== null);
    if (columns.length)
      part.append(table("Settings", [{ head: "Setting" }, ...columns.map((name) => ({ head: { method: "Method", reference: "Reference", again: "Reference again" }[name], words: true }))],
        keys.map((key) => ({ cells: [key, ...columns.map((name) => setting_text(settings[name][key]))] }))));
    part.append(table("Provenance", [{ head: "What" }, { head: "Value", words: true }], facts.map(([name, value]) => ({ cells: [name, element("span", { class: /^(File|SHA)/.test(name) ? "code" : undefined }, String(value))] }))));
  }

  // Data

  if (points.length) {
    const part = section("data", "Data", "All values are in comparison.json and the CSV files beside this page, too.");
    const frame = element("div");
    const made = details("Every point of the sensors shown", frame);
    const fill = () => {
      part.hidden = !members.get(state.set)?.length;
      if (!made.open) return frame.replaceChildren();
      const difference = chosen_difference();
      frame.replaceChildren(table(`Points of “${state.set}”, ${component_name()}, lx`, [{ head: "Point" }, { head: "x, y, z, m" }, { head: "Reference" }, { head: "Method" }, { head: "Method − reference" }, { head: "Again − reference" },
        ...(difference[0] === "total" || difference[0] === "again" ? [] : [{ head: difference[1] }])],
      (members.get(state.set) || []).map((index) => ({ cells: [points[index].id, place_text([points[index].x, points[index].y, points[index].z]), number(reference_at(index), 5), number(method_at(index), 5),
        signed(minus(method_at(index), reference_at(index))), signed(minus(again_at(index), reference_at(index))),
        ...(difference[0] === "total" || difference[0] === "again" ? [] : [signed(difference[2](index))])] })), true));
    };
    made.addEventListener("toggle", fill);
    updates.push(fill);
    part.append(made);
  }

  update();
})();
