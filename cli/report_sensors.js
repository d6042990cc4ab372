"use strict";
// What a report says of each set of sensors: statistics, origin of the light, plan in false colour with isolines, section.
const report_sensors = (() => {
  const { list, record, finite, bytes_of, number, with_unit, place_text, plain, stepped, metres_text, element, svg, section, table, details, nothing, viridis, colour_of, round_up, scale_end, round_steps, show_scale } = page;

  // Longer tables are slow, and nobody reads them here.
  const most_rows = 2500;
  const has_keys_of_browser = (event) => event.ctrlKey || event.metaKey || event.altKey;

  /** Rows of a table with commas and quotes, as objects by column. */
  const parse_csv = (text) => {
    const rows = [];
    let row = [], cell = "", quoted = false;
    for (let k = 0; k < text.length; ++k) {
      const c = text[k];
      if (quoted) {
        if (c !== '"') cell += c;
        else if (text[k + 1] === '"') cell += text[++k];
        else quoted = false;
      } else if (c === '"') quoted = true;
      else if (c === "," || c === "\n") {
        row.push(cell);
        cell = "";
        if (c === "\n") {
          rows.push(row);
          row = [];
        }
      } else cell += c;
    }
    const [head, ...body] = rows;
    return body.map((cells) => Object.fromEntries(head.map((name, k) => [name, cells[k]])));
  };

  const quantities = [
    { key: "daylight_factor_percent", name: "Daylight factor", unit: "%", limits: [2, 5], levels: [0.1, 0.2, 0.5, 1, 2, 3, 5, 7, 10, 15, 20, 30, 50] },
    { key: "total_lx", name: "Illuminance", unit: "lx", limits: [300, 500] },
    { key: "sky_lx", name: "Sky component (SC)", unit: "lx", limits: [] },
    { key: "sun_lx", name: "Sun", unit: "lx", limits: [] },
    { key: "erc_lx", name: "Reflected outdoors (ERC)", unit: "lx", limits: [] },
    { key: "irc_lx", name: "Reflected indoors (IRC)", unit: "lx", limits: [] },
  ];
  const lux_levels = [1, 2, 5, 10, 20, 50, 100, 200, 300, 500, 750, 1000, 1500, 2000, 3000, 5000, 10000, 20000, 50000, 100000];

  const ordered = (values) => values.filter(finite).sort((a, b) => a - b);
  const mean_of = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const statistics_of = (values) => {
    const all = ordered(values), n = all.length;
    if (!n) return undefined;
    const mean = mean_of(all);
    return { mean, median: (all[(n - 1) >> 1] + all[n >> 1]) / 2, min: all[0], max: all[n - 1], uniformity: mean > 0 ? all[0] / mean : NaN };
  };

  /** Points of a set with numbers in place of texts; empty cells become NaN. */
  const points_of = (rows) => rows.map((row) => {
    const point = { id: row.id, medium: row.medium };
    for (const [name, text] of Object.entries(row)) if (!["id", "set", "medium"].includes(name)) point[name] = text === "" ? NaN : Number(text);
    return point;
  });

  const least = (values) => values.reduce((least, value) => Math.min(least, value), Infinity);
  const most = (values) => values.reduce((most, value) => Math.max(most, value), -Infinity);

  /** Points of a grid by room: each room has a lattice of its own. {x0, y0, columns, rows, at: [row][column] -> point, members} */
  const lattices_of = (points, spacing) => {
    const rooms = new Map();
    for (const point of points) {
      if (!rooms.has(point.room)) rooms.set(point.room, []);
      rooms.get(point.room).push(point);
    }
    return [...rooms.values()].map((members) => {
      const x0 = least(members.map((point) => point.x_m)), y0 = least(members.map((point) => point.y_m));
      const column = (point) => Math.round((point.x_m - x0) / spacing), row = (point) => Math.round((point.y_m - y0) / spacing);
      const columns = 1 + most(members.map(column)), rows = 1 + most(members.map(row));
      const at = Array.from({ length: rows }, () => new Array(columns));
      for (const point of members) at[row(point)][column(point)] = point;
      return { x0, y0, columns, rows, at, members };
    });
  };

  /** Lines of one level through a lattice, as lists of places in the plane: marching squares. */
  const isolines_of = (lattice, spacing, key, level) => {
    const segments = [];
    for (let j = 0; j + 1 < lattice.rows; ++j)
      for (let i = 0; i + 1 < lattice.columns; ++i) {
        const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]], values = corners.map(([x, y]) => lattice.at[y][x]?.[key]);
        if (!values.every(finite)) continue;
        const crossings = [];
        for (let k = 0; k < 4; ++k) {
          const a = corners[k], b = corners[(k + 1) % 4], va = values[k], vb = values[(k + 1) % 4];
          if (va >= level === vb >= level) continue;
          const share = (level - va) / (vb - va);
          crossings.push({ edge: `${Math.min(a[0], b[0])} ${Math.min(a[1], b[1])} ${a[0] === b[0]}`, x: lattice.x0 + spacing * (a[0] + share * (b[0] - a[0])), y: lattice.y0 + spacing * (a[1] + share * (b[1] - a[1])) });
        }
        if (crossings.length === 2) segments.push(crossings);
        else if (crossings.length === 4) {
          // A saddle: the middle decides which corners go together.
          const joined = mean_of(values) >= level === values[0] >= level;
          segments.push(...(joined ? [[crossings[0], crossings[1]], [crossings[2], crossings[3]]] : [[crossings[3], crossings[0]], [crossings[1], crossings[2]]]));
        }
      }
    const ends = new Map();
    segments.forEach((segment) => segment.forEach(({ edge }) => ends.set(edge, [...(ends.get(edge) || []), segment])));
    const used = new Set(), lines = [];
    const walk = (from, edge) => {
      const places = [];
      for (let at = edge; ;) {
        const next = ends.get(at).find((segment) => !used.has(segment));
        if (!next) return places;
        used.add(next);
        const far = next[0].edge === at ? next[1] : next[0];
        places.push(far);
        at = far.edge;
      }
    };
    for (const segment of segments) {
      if (used.has(segment)) continue;
      used.add(segment);
      lines.push([...walk(segment, segment[0].edge).reverse(), segment[0], segment[1], ...walk(segment, segment[1].edge)]);
    }
    return lines;
  };

  /** Few digits: maps have little room. */
  const short = (value, unit) => (!finite(value) ? "" : unit === "%" ? (value < 10 ? value.toFixed(1) : value.toFixed(0)) : value < 10 ? number(value, 2) : number(Math.round(value), Math.round(value) < 1000 ? 3 : 6));

  /** A select among the quantities that the points have. */
  const quantity_choice = (points, label, chosen, changed) => {
    const offered = quantities.filter(({ key }) => points.some((point) => finite(point[key])));
    const select = element("select", {}, ...offered.map(({ key, name, unit }) => element("option", { value: key }, `${name}, ${unit}`)));
    select.value = chosen.key;
    select.addEventListener("change", () => changed(offered.find(({ key }) => key === select.value)));
    return element("label", {}, label, select);
  };

  // Statistics and origin of the light

  const draw_statistics = (part, points, summary, is_grid) => {
    const present = quantities.slice(0, 2).map((quantity) => [quantity, statistics_of(points.map((point) => point[quantity.key]))]).filter(([, found]) => found);
    if (!present.length) {
      part.append(nothing("None of these points is in the air: they have no values."));
      return;
    }
    part.append(table("Statistics (uniformity: minimum over mean)", [{ head: "Quantity" }, ...["Mean", "Median", "Minimum", "Maximum", "Uniformity"].map((head) => ({ head }))],
      present.map(([{ name, unit }, found]) => ({ cells: [`${name}, ${unit}`, number(found.mean), number(found.median), number(found.min), number(found.max), number(found.uniformity, 2)] }))));
    if (is_grid) draw_thresholds(part, points, present);
    draw_origin(part, record(summary.mean_components_lx));
  };

  const draw_thresholds = (part, points, present) => {
    const share_above = (key, limit) => {
      const known = points.map((point) => point[key]).filter(finite);
      return with_unit(((100 * known.filter((value) => value >= limit).length) / known.length).toFixed(0), "%");
    };
    const tiles = element("dl", { class: "tiles" });
    const own = Object.fromEntries(present.map(([{ key, limits }]) => [key, limits[1] * 2]));
    const fill = () => tiles.replaceChildren(...present.flatMap(([{ key, unit, name, limits }]) => [...limits, own[key]].map((limit) =>
      element("div", { class: "tile" }, element("dt", {}, `${name} ≥ ${plain(limit)}\u00a0${unit}`), element("dd", {}, share_above(key, limit), element("small", {}, "of the area"))))));
    const inputs = present.map(([{ key, name, unit }]) => {
      const input = element("input", { type: "number", min: "0", step: "any", value: own[key] });
      input.addEventListener("input", () => {
        if (input.value !== "" && Number(input.value) >= 0) own[key] = Number(input.value);
        fill();
      });
      return element("label", {}, `${name} ≥`, input, unit);
    });
    part.append(element("h3", { class: "group" }, "Share of the points above a threshold"), tiles, element("div", { class: "settings", role: "group", "aria-label": "Thresholds of your own" }, ...inputs));
    fill();
  };

  const draw_origin = (part, mean) => {
    const names = [["sky", "sky (SC)", "#56b4e9"], ["sun", "sun", "#e69f00"], ["erc_ground", "ground (ERC)", "#009e73"], ["erc_buildings", "buildings (ERC)", "#cc79a7"], ["irc", "interreflection (IRC)", "#7f7f7f"]];
    const total = names.reduce((sum, [key]) => sum + (mean[key] || 0), 0);
    if (!(total > 0)) return;
    const bar = element("div", { class: "parts", "aria-hidden": "true" });
    for (const [key, , colour] of names) {
      if (!(mean[key] > 0)) continue;
      const piece = element("span");
      piece.style.cssText = `background: ${colour}; flex: ${(100 * mean[key]) / total} 1 0`;
      bar.append(piece);
    }
    const swatch = (colour) => {
      const made = element("span", { class: "swatch" });
      made.style.background = colour;
      return made;
    };
    const label = (colour, text) => {
      const made = element("span", {}, swatch(colour), text);
      return made;
    };
    part.append(element("h3", { class: "group" }, "Where the light comes from"), element("div", { class: "narrow" }, bar,
      table("Mean illuminance by component", [{ head: "Component" }, { head: "Mean, lx" }, { head: "Share" }],
        [...names.map(([key, name, colour]) => ({ cells: [label(colour, name), number(mean[key] || 0), with_unit(((100 * (mean[key] || 0)) / total).toFixed(0), "%")] })),
          { class: "total", cells: ["Total", number(total), with_unit("100", "%")] }])));
  };

  // Plan

  const draw_plan = (part, points, set, north_rad, title) => {
    const spacing = set.grid.spacing_m, lattices = lattices_of(points, spacing), rings = list(record(set.plan).rings), windows = list(record(set.plan).windows), windows_elsewhere = list(record(set.plan).windows_above_or_below);
    const state = { quantity: quantities.find(({ key }) => points.some((point) => finite(point[key]))) || quantities[1], values: true, isolines: true, row: undefined, cursor: -1 };
    const places = [...rings.flat(), ...windows.flat(), ...windows_elsewhere.flat(), ...points.map((point) => [point.x_m, point.y_m])];
    const ends = (axis, sign) => sign * places.reduce((most, place) => Math.max(most, sign * place[axis]), -Infinity);
    const low = [ends(0, -1), ends(1, -1)], high = [ends(0, 1), ends(1, 1)];
    const frame = element("div", { class: "plan-frame", tabindex: "0", role: "application", "aria-label": `Plan of “${title}”: arrow keys read the points` });
    const bar = element("div", { class: "bar" }), ticks = element("div", { class: "ticks", "aria-hidden": "true" }), scale = element("div", { class: "scale" }, bar, ticks);
    const caption = element("figcaption"), reading = element("p", { class: "reading", "aria-live": "polite" }, "Point at the plan, or give it the focus and move with the arrow keys, to read values.");
    const checkbox = (label, key) => {
      const made = element("input", { type: "checkbox" });
      made.checked = state[key];
      made.addEventListener("change", () => {
        state[key] = made.checked;
        paint();
      });
      return element("label", {}, made, label);
    };
    const settings = element("div", { class: "settings", role: "group", "aria-label": "What the plan shows" },
      quantity_choice(points, "Shows", state.quantity, (quantity) => {
        state.quantity = quantity;
        update();
      }), checkbox("values", "values"), checkbox("isolines", "isolines"));
    const values_frame = element("div");
    part.append(element("h3", { class: "group" }, "Plan and section"), settings, element("figure", {}, caption, frame, scale), reading);

    // The main axis is the longer one; rows run along it.
    const along = high[0] - low[0] >= high[1] - low[1] ? "x" : "y", across = along === "x" ? "y" : "x";
    const largest_room = lattices.reduce((a, b) => (b.members.length > a.members.length ? b : a));
    const rows = Array.from({ length: across === "x" ? largest_room.columns : largest_room.rows }, (_, k) => largest_room[across + "0"] + k * spacing);
    // At first the row with most points, the middlemost of those: in an L-shaped room the middle may lie along a wall.
    const on_row = (row, key) => points.filter((point) => Math.abs(point[across + "_m"] - row) < 0.002 && finite(point[key]));
    const counts = rows.map((row) => on_row(row, "total_lx").length);
    const longest = most(counts), fullest = rows.filter((_, k) => counts[k] === longest);
    state.row = fullest[(fullest.length - 1) >> 1];
    const row_choice = element("select", {}, ...rows.map((row) => element("option", { value: row }, `${across} = ${row.toFixed(2)} m`)));
    row_choice.value = state.row;
    row_choice.addEventListener("change", () => {
      state.row = Number(row_choice.value);
      paint();
      paint_section();
    });
    const section_caption = element("figcaption"), section_frame = element("div", { class: "plan-frame" });
    part.append(element("div", { class: "settings" }, element("label", {}, "Section along the row", row_choice)), element("figure", {}, section_caption, section_frame), values_frame);

    let largest = 1, to_plane = () => [0, 0];
    const fits = (lattice) => lattice.members.length <= most_rows;
    const value_at = (point) => point[state.quantity.key];
    const paint = () => {
      const { key, name, unit, levels = lux_levels } = state.quantity;
      const all = ordered(points.map(value_at));
      largest = scale_end(all);
      const width = Math.max(280, frame.clientWidth || 640), edge = 14, foot = 40;
      const metre = Math.min((width - 2 * edge) / (high[0] - low[0] || 1), 560 / (high[1] - low[1] || 1));
      const inner = [(high[0] - low[0]) * metre, (high[1] - low[1]) * metre], left = (width - inner[0]) / 2;
      const height = inner[1] + 2 * edge + foot;
      const x_of = (x) => left + (x - low[0]) * metre, y_of = (y) => edge + (high[1] - y) * metre;
      to_plane = (x, y) => [low[0] + (x * width - left) / metre, high[1] - (y * height - edge) / metre];
      const drawing = svg("svg", { class: "drawing", viewBox: `0 0 ${width.toFixed(1)} ${height.toFixed(1)}`, role: "img", "aria-label": `${name} in plan, ${unit}; ${lattices.every(fits) ? "the tables hold" : "sensors.csv holds"} the numbers` });
      const outline = rings.map((ring) => `M${ring.map(([x, y]) => `${x_of(x).toFixed(1)} ${y_of(y).toFixed(1)}`).join("L")}Z`).join("");
      const clip = `clip-${part.id}`;
      if (outline) drawing.append(svg("clipPath", { id: clip }, svg("path", { d: outline, "clip-rule": "evenodd" })));
      for (const lattice of lattices) {
        const bitmap = element("canvas", { width: lattice.columns, height: lattice.rows }), pen = bitmap.getContext("2d");
        for (const point of lattice.members) {
          if (!finite(value_at(point))) continue;
          pen.fillStyle = colour_of(viridis, value_at(point) / largest);
          pen.fillRect(Math.round((point.x_m - lattice.x0) / spacing), lattice.rows - 1 - Math.round((point.y_m - lattice.y0) / spacing), 1, 1);
        }
        const image = svg("image", { x: x_of(lattice.x0 - spacing / 2), y: y_of(lattice.y0 + (lattice.rows - 0.5) * spacing), width: lattice.columns * spacing * metre, height: lattice.rows * spacing * metre, preserveAspectRatio: "none", href: bitmap.toDataURL(), style: "image-rendering: pixelated" });
        if (outline) image.setAttribute("clip-path", `url(#${clip})`);
        drawing.append(image);
      }
      const labels = [];
      if (state.isolines) {
        const inside = levels.filter((level) => level > all[0] && level < all.at(-1)).slice(-9);
        for (const level of inside)
          for (const lattice of lattices)
            for (const line of isolines_of(lattice, spacing, key, level)) {
              const on_paper = line.map(({ x, y }) => [x_of(x), y_of(y)]), d = `M${on_paper.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}`;
              drawing.append(svg("path", { class: "halo", d }), svg("path", { class: "isoline", d }));
              const length = on_paper.slice(1).reduce((sum, place, k) => sum + Math.hypot(place[0] - on_paper[k][0], place[1] - on_paper[k][1]), 0);
              const middle = on_paper[on_paper.length >> 1];
              if (length > 40 && labels.every(([x, y]) => Math.hypot(x - middle[0], y - middle[1]) > 26)) labels.push([...middle, plain(level)]);
            }
      }
      if (outline) drawing.append(svg("path", { class: "wall", d: outline }));
      for (const [[x1, y1], [x2, y2]] of windows) drawing.append(svg("line", { class: "window", x1: x_of(x1), y1: y_of(y1), x2: x_of(x2), y2: y_of(y2) }));
      for (const places of windows_elsewhere) {
        const d = `M${places.map(([x, y]) => `${x_of(x).toFixed(1)} ${y_of(y).toFixed(1)}`).join("L")}${places.length > 2 ? "Z" : ""}`;
        drawing.append(svg("path", { class: "halo", d }), svg("path", { class: "window-elsewhere", d }));
      }
      if (state.values) {
        const stride = Math.max(1, Math.ceil((unit === "%" ? 32 : 38) / (spacing * metre)));
        for (const lattice of lattices)
          for (const point of lattice.members) {
            const i = Math.round((point.x_m - lattice.x0) / spacing), j = Math.round((point.y_m - lattice.y0) / spacing);
            if (!finite(value_at(point)) || (i - (stride >> 1)) % stride || (j - (stride >> 1)) % stride) continue;
            const [x, y] = [x_of(point.x_m), y_of(point.y_m)];
            if (labels.some((label) => Math.abs(label[0] - x) < 26 && Math.abs(label[1] - y) < 13)) continue;
            const text = svg("text", { class: "value", x, y: y + 3.5, style: `fill: ${value_at(point) / largest > 0.46 ? "#14181c" : "#fff"}; stroke: ${colour_of(viridis, value_at(point) / largest)}` }, short(value_at(point), unit));
            drawing.append(text);
          }
      }
      for (const [x, y, text] of labels) drawing.append(svg("text", { class: "level", x, y: y + 4 }, text));
      const at_row = along === "x" ? { x1: left - 8, x2: left + inner[0] + 8, y1: y_of(state.row), y2: y_of(state.row) } : { x1: x_of(state.row), x2: x_of(state.row), y1: edge - 8, y2: edge + inner[1] + 8 };
      drawing.append(svg("line", { class: "section", ...at_row }));
      // Scale bar and north.
      const metres = [0.5, 1, 2, 5, 10, 20, 50, 100].find((length) => length * metre > 60) || 200, base = height - 14;
      drawing.append(svg("path", { class: "axis", d: `M${left} ${base - 5}v5h${metres * metre}v-5` }), svg("text", { x: left + metres * metre + 6, y: base }, `${plain(metres)} m`));
      const north = [Math.sin(-north_rad), -Math.cos(-north_rad)], centre = [left + inner[0] - 14, height - 20];
      const tip = centre.map((value, k) => value + 13 * north[k]), side = [north[1], -north[0]];
      drawing.append(svg("path", { d: `M${tip}L${centre.map((value, k) => value - 9 * north[k] + 6 * side[k])}L${centre.map((value, k) => value - 4 * north[k])}L${centre.map((value, k) => value - 9 * north[k] - 6 * side[k])}Z`, fill: "currentColor" }),
        svg("text", { x: centre[0] - 16, y: centre[1] + 4, "text-anchor": "end" }, "N"));
      const pointed = points[state.cursor];
      if (pointed) drawing.append(svg("circle", { class: "cursor", cx: x_of(pointed.x_m), cy: y_of(pointed.y_m), r: Math.max(5, 0.4 * spacing * metre) }));
      frame.replaceChildren(drawing);
      caption.replaceChildren(`${name}, ${unit} `, element("span", {}, `z = ${metres_text(set.grid.z_m)} m, points every ${metres_text(spacing)} m; orange: the section below${windows.length || windows_elsewhere.length ? "; blue: windows" : ""}${windows_elsewhere.length ? ", dashed where they are above or below this height" : ""}`));
      show_scale(bar, ticks, largest, unit, all.at(-1) > largest);
    };
    const paint_section = () => {
      const { key, name, unit, limits } = state.quantity;
      const row = on_row(state.row, key).sort((a, b) => a[along + "_m"] - b[along + "_m"]);
      section_caption.replaceChildren(`${name} along ${along} `, element("span", {}, `at ${across} = ${state.row.toFixed(2)} m, ${unit}`));
      section_frame.replaceChildren(draw_curve(row.map((point) => [point[along + "_m"], point[key], point.room]), `${along}, m`, unit, limits, 1.5 * spacing, section_frame.clientWidth, `${name} along the section`));
    };
    const paint_values = () => {
      const { key, name, unit } = state.quantity;
      const open = Array.from(values_frame.children, (made) => made.open);
      values_frame.replaceChildren(...lattices.map((lattice, k) => !fits(lattice) ? too_many(`${lattices.length > 1 ? `Room ${k + 1}` : "The grid"} has ${lattice.members.length} points`) : details(`Values of ${name.toLowerCase()}, ${unit}, as a table${lattices.length > 1 ? `, room ${k + 1}` : ""}`,
        table(`${name}, ${unit}: columns are x, rows are y, m`, [{ head: "y \\ x" }, ...Array.from({ length: lattice.columns }, (_, i) => ({ head: (lattice.x0 + i * spacing).toFixed(2) }))],
          Array.from({ length: lattice.rows }, (_, n) => lattice.rows - 1 - n).map((j) => ({ cells: [(lattice.y0 + j * spacing).toFixed(2), ...Array.from({ length: lattice.columns }, (_, i) => short(lattice.at[j][i]?.[key], unit) || "–")] })), true))));
      Array.from(values_frame.children, (made, k) => { made.open = open[k]; });
    };
    const read = (index) => {
      if (index < 0) return;
      state.cursor = index;
      const point = points[index];
      reading.replaceChildren(element("strong", {}, `${point.id}, at (${place_text([point.x_m, point.y_m, point.z_m])}) m `), point_words(point));
      Object.assign(reading.dataset, { id: point.id, total: point.total_lx });
      paint();
    };
    const nearest = (place) => points.reduce((best, point, k) => {
      const distance = Math.hypot(point.x_m - place[0], point.y_m - place[1]);
      return distance < best.distance ? { distance, k } : best;
    }, { distance: Infinity, k: -1 }).k;
    frame.addEventListener("click", (event) => {
      const area = frame.firstElementChild.getBoundingClientRect();
      read(nearest(to_plane((event.clientX - area.left) / area.width, (event.clientY - area.top) / area.height)));
    });
    frame.addEventListener("keydown", (event) => {
      if (has_keys_of_browser(event)) return;
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      const from = points[state.cursor];
      read(from ? nearest([from.x_m + step[0] * spacing, from.y_m + step[1] * spacing]) : nearest([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2]));
    });
    const update = () => {
      paint();
      paint_section();
      paint_values();
    };
    update();
    let width = frame.clientWidth;
    new ResizeObserver(() => {
      if (frame.clientWidth === width) return;
      width = frame.clientWidth;
      paint();
      paint_section();
    }).observe(frame);
  };

  const too_many = (text) => element("p", { class: "note" }, `${text}, too many for a table here: sensors.csv holds their values.`);
  const point_words = (point) => (finite(point.total_lx)
    ? `${with_unit(number(point.total_lx, 4), "lx")}: sky ${number(point.sky_lx)}, sun ${number(point.sun_lx)}, ground ${number(point.erc_ground_lx)}, buildings ${number(point.erc_buildings_lx)}, interreflection ${number(point.irc_lx)}` +
      (finite(point.daylight_factor_percent) ? `; daylight factor ${with_unit(number(point.daylight_factor_percent), "%")}.` : ".")
    : "The point lies in a solid and has no value.");

  /** A curve with its points. spots: [place, value, room]. It is interrupted where neighbours are farther apart than `gap` or in two rooms. */
  const draw_curve = (spots, axis_name, unit, limits, gap, client_width, words) => {
    if (spots.length < 2) return nothing("This row has fewer than two points.");
    const width = Math.max(280, client_width || 640), height = Math.min(280, 0.5 * width + 60), left = 46, right = 44, top = 12, bottom = 34;
    const largest = round_up(most(spots.map(([, value]) => value))), first = spots[0][0], last = spots.at(-1)[0];
    const x_of = (x) => left + ((x - first) / (last - first)) * (width - left - right), y_of = (y) => height - bottom - (y / largest) * (height - top - bottom);
    const drawing = svg("svg", { class: "drawing", viewBox: `0 0 ${width.toFixed(1)} ${height.toFixed(1)}`, role: "img", "aria-label": `${words}: ${spots.map(([x, y]) => `${short(y, unit)} ${unit} at ${x.toFixed(2)} m`).join("; ").slice(0, 900)}` });
    for (const value of round_steps(largest, 5)) drawing.append(svg("line", { class: "lattice", x1: left, x2: width - right, y1: y_of(value), y2: y_of(value) }), svg("text", { class: "quiet", x: left - 6, y: y_of(value) + 4, "text-anchor": "end" }, plain(value)));
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].find((metres) => (metres / (last - first)) * (width - left - right) > Math.max(44, 10 + 6.2 * stepped(last, metres).length)) || 100;
    for (let x = Math.ceil(first / step - 1e-9) * step; x <= last + 1e-9; x += step) drawing.append(svg("line", { class: "axis", x1: x_of(x), x2: x_of(x), y1: height - bottom, y2: height - bottom + 4 }), svg("text", { class: "quiet", x: x_of(x), y: height - bottom + 16, "text-anchor": "middle" }, stepped(Math.round(x / step) * step, step)));
    drawing.append(svg("path", { class: "axis", d: `M${left} ${top}V${height - bottom}H${width - right}` }), svg("text", { class: "quiet", x: width - right, y: height - 4, "text-anchor": "end" }, axis_name), svg("text", { class: "quiet", x: left + 6, y: top + 8 }, unit));
    for (const limit of limits) if (limit < largest) drawing.append(svg("line", { class: "limit", x1: left, x2: width - right, y1: y_of(limit), y2: y_of(limit) }), svg("text", { x: width - right + 4, y: y_of(limit) + 4 }, `${plain(limit)}\u00a0${unit}`));
    drawing.append(svg("path", { class: "curve", d: spots.map(([x, y], k) => `${k === 0 || x - spots[k - 1][0] > gap || spots[k][2] !== spots[k - 1][2] ? "M" : "L"}${x_of(x).toFixed(1)} ${y_of(y).toFixed(1)}`).join("") }));
    for (const [x, y] of spots) drawing.append(svg("circle", { class: "spot", cx: x_of(x), cy: y_of(y), r: 3 }));
    return drawing;
  };

  /** Single points: a table, and a curve where they stand in a line. */
  const draw_points = (part, points) => {
    const seen = points.filter((point) => finite(point.total_lx));
    part.append(points.length > most_rows ? too_many(`The set has ${points.length} points`) : table("Points", [{ head: "Point" }, { head: "x, y, z, m" }, { head: "Daylight factor, %" }, { head: "Total, lx" }, { head: "Sky" }, { head: "Sun" }, { head: "ERC" }, { head: "IRC" }],
      points.map((point) => ({ cells: [point.id, place_text([point.x_m, point.y_m, point.z_m]), number(point.daylight_factor_percent), number(point.total_lx), number(point.sky_lx), number(point.sun_lx), number(point.erc_lx), number(point.irc_lx)] })), points.length > 20));
    if (seen.length < 3) return;
    const place = (point) => [point.x_m, point.y_m, point.z_m], start = place(seen[0]), span = place(seen.at(-1)).map((value, k) => value - start[k]), length = Math.hypot(...span);
    const along = (point) => place(point).reduce((sum, value, k) => sum + (value - start[k]) * span[k], 0) / length;
    const off = (point) => Math.hypot(...place(point).map((value, k) => value - start[k] - (along(point) / length) * span[k]));
    if (!(length > 0) || seen.some((point) => off(point) > 0.01) || seen.some((point, k) => k > 0 && along(point) <= along(seen[k - 1]))) return;
    const quantity = quantities.find(({ key }) => seen.every((point) => finite(point[key])));
    const frame = element("div", { class: "plan-frame" });
    part.append(element("figure", {}, element("figcaption", {}, `${quantity.name} along the points `, element("span", {}, `from the first point on, ${quantity.unit}`)), frame));
    const paint = () => frame.replaceChildren(draw_curve(seen.map((point) => [along(point), point[quantity.key], 0]), "distance, m", quantity.unit, quantity.limits, Infinity, frame.clientWidth, quantity.name));
    paint();
    let width = frame.clientWidth;
    new ResizeObserver(() => {
      if (frame.clientWidth === width) return;
      width = frame.clientWidth;
      paint();
    }).observe(frame);
  };

  const draw_set = (part, points, set, summary, report) => {
    if (!points.length) {
      part.append(nothing("The set has no points."));
      return;
    }
    draw_statistics(part, points, summary, Boolean(set.grid));
    if (set.grid && points.some((point) => finite(point.total_lx))) draw_plan(part, points, set, report.north_rad, set.id);
    else if (!set.grid) draw_points(part, points);
  };

  const draw = (report) => {
    const rows = parse_csv(new TextDecoder().decode(bytes_of(report.sensors_csv))), by_set = new Map();
    for (const row of rows) {
      if (!by_set.has(row.set)) by_set.set(row.set, []);
      by_set.get(row.set).push(row);
    }
    report.sets.forEach((set, k) => {
      const points = points_of(by_set.get(set.id) || []), summary = record(list(report.summary.sensor_sets)[k]);
      points.forEach((point, n) => { point.room = list(set.rooms)[n]; });
      const part = section(`sensors-${k + 1}`, `Sensors: ${set.id}`, `${points.length} points${set.grid ? `, a horizontal grid every ${metres_text(set.grid.spacing_m)} m at z = ${metres_text(set.grid.z_m)} m` : ""}.` +
        (summary.points_in_solid > 0 ? ` ${summary.points_in_solid} of them lie in a solid and have no values.` : "") + (summary.points_outdoors > 0 ? ` ${summary.points_outdoors} of them lie outdoors.` : ""));
      // What cannot be shown shall not take the rest of the page with it.
      try {
        draw_set(part, points, set, summary, report);
      } catch (error) {
        console.error(error);
        part.append(nothing(`The rest of this set cannot be shown here (${error.message}): sensors.csv holds its values.`));
      }
    });
  };
  return draw;
})();
