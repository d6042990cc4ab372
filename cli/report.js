"use strict";
// Puts the report of a run together from the data embedded in the page.
(() => {
  const { list, record, finite, bytes_of, number, with_unit, plain, setting_text, element, section, table, details } = page;
  const report = JSON.parse(document.getElementById("report").textContent), summary = report.summary;

  const swatch = (channels) => {
    const made = element("span", { class: "swatch" });
    made.style.background = `rgb(${channels.join(",")})`;
    return made;
  };
  const percent = (share, digits = 2) => with_unit(number(100 * share, digits), "%");
  const facts = (pairs) => element("dl", { class: "facts" }, ...pairs.filter(([, value]) => value !== undefined).flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
  const in_words = (name) => name.replaceAll("_", " ");

  // Assumptions and provenance

  {
    const part = section("basis", "What was computed, and how");
    const { scene, backend, options, outdoors, estimated_error: error } = summary, sun = outdoors.sun, quality = record(summary.quality);
    const settings = Object.entries(record(backend.settings));
    part.append(facts([
      ["Scene", scene.name ? `${scene.name} (${scene.file})` : scene.file],
      ["SHA-256 of the file", element("span", { class: "code" }, scene.sha256)],
      ["Program", `naturel ${summary.naturel}, ${backend.name}, quality “${options.quality}”`],
      ["Estimated error", error ? `${percent(error.relative_error)}: 95 % of ${error.points} sensors are estimated to be nearer than that (sampling ${percent(error.sampling)}, grid ${finite(error.grid) ? percent(error.grid) : "not estimated"}, direct light ${percent(error.direct)})` : "not estimated"],
      ["Sky", `${in_words(outdoors.sky)}: ${report.sky_words}; ${with_unit(number(outdoors.horizontal_illuminance_lx, 4), "lx")} on the unobstructed horizontal plane`],
      ["Sun", sun ? `altitude ${plain(sun.altitude_deg)}°, azimuth ${plain(sun.azimuth_deg)}° from north clockwise; ${with_unit(number(sun.direct_normal_illuminance_lx), "lx")} direct normal` : "none"],
      ["Ground", `reflectance ${number(report.ground_reflectance, 2)}`],
      ["Grid", `${summary.counts.patches} patches, ${summary.counts.nodes} nodes; cells up to ${with_unit(plain(options.grid_spacing_m), "m")}${options.grid_zones ? ", cut along sunspots and umbra zones" : ""}`],
      ["Radiosity", quality.radiosity ? `${quality.radiosity.converged ? "converged" : "NOT converged"} after ${quality.radiosity.iterations} iterations; flux balance closed to ${percent(quality.flux.relative_gap)}` : undefined],
    ]));
    const tables = element("div", { class: "group" });
    part.append(tables);
    if (list(report.windows).length)
      tables.append(table("Windows and glazing", [{ head: "Window" }, { head: "Area, m²" }, { head: "Glazing", words: true }, { head: "Transmittance, normal" }, { head: "Panes" }, { head: "Inner reflectance" }, { head: "Maintenance" }, { head: "Frame" }],
        report.windows.map((window) => ({ cells: [window.name + (window.inner ? " (between rooms)" : ""), number(window.area_m2), window.glazing, number(window.normal_transmittance, 2), String(window.panes), number(window.inner_reflectance, 2), number(window.maintenance, 2), number(window.frame, 2)] })), report.windows.length > 12));
    const glowing = report.materials.some((material) => material.exitance_lm_m2 > 0);
    tables.append(table("Materials", [{ head: "Material" }, { head: "Reflectance" }, ...(glowing ? [{ head: "Emits, lm/m²" }] : [])],
      report.materials.map((material) => ({ cells: [element("span", {}, swatch(material.colour), material.name), number(material.reflectance, 2), ...(glowing ? [number(material.exitance_lm_m2)] : [])] })), report.materials.length > 12));
    part.append(element("h3", { class: "group" }, "Assumptions"), element("ul", { class: "assumptions" }, ...list(summary.assumptions).map((text) => element("li", {}, text))));
    part.append(details("Every option", table("Options of the run", [{ head: "Option" }, { head: "Value", words: true }], Object.entries(options).map(([name, value]) => ({ cells: [in_words(name), setting_text(value)] }))),
      ...(settings.length ? [table(`Options of the backend ${backend.name}`, [{ head: "Option" }, { head: "Value", words: true }], settings.map(([name, value]) => ({ cells: [in_words(name), setting_text(value)] })))] : [])));
  }

  report_surfaces(report);
  report_sensors(report);

  // Glare

  const views = list(summary.views), judged = views.filter(({ glare }) => glare);
  const simplified_words = (glare) => number(glare.dgps, 2) + (glare.direct_sun_lx > 0 ? " (not valid: sun at the eye)" : glare.dgps_valid ? "" : " (outside its range)");
  const probability_words = (glare) => `${number(glare.dgp, 2)}, ${glare.dgp_class}${glare.dgp_valid ? "" : " (outside its range)"}`;
  if (judged.length) {
    const part = section("glare", "Glare", "At the eyes of fisheye views: DGP from the illuminance of the eye and the sources of glare in its picture, DGPs from the illuminance alone. Sources are in glare.json.");
    part.append(table("Daylight glare probability", [{ head: "View" }, { head: "At the eye (Ev), lx" }, { head: "Ev by the picture, lx" }, { head: "Straight from the sun, lx" }, { head: "DGP", words: true }, { head: "DGPs", words: true }],
      judged.map(({ id, glare }) => ({ cells: [id, number(glare.vertical_illuminance_lx, 4), number(glare.vertical_illuminance_of_picture_lx, 4), number(glare.direct_sun_lx, 4), probability_words(glare), simplified_words(glare)] }))));
  }

  // Pictures

  const natural_words = (shown) => (shown.png_tone_mapping && shown.png_tone_mapping !== "linear" ? `natural colours, tone mapping “${shown.png_tone_mapping}”` : finite(shown.png_white_cd_m2) ? `natural colours; ${with_unit(number(shown.png_white_cd_m2), "cd/m²")} is white` : "natural colours");
  const false_words = ({ quantity, unit, scale, maximum, contours }) => {
    const words = { luminance: "luminance", illuminance: "illuminance of surfaces", daylight_factor: "daylight factor of surfaces" }[quantity] || in_words(String(quantity)), shown_unit = String(unit).replace("m2", "m²");
    const end = finite(maximum) ? with_unit(plain(maximum), shown_unit) : "the end of the legend in the picture";
    const range = scale === "logarithmic" ? `logarithmic scale over three decades up to ${end}` : `linear scale from 0 to ${end}`;
    return `false colour: ${words}, ${shown_unit}; ${range}${list(contours).length ? `; lines at ${contours.map(plain).join(", ")} ${shown_unit}` : ""}`;
  };
  if (report.pictures.length) {
    const part = section("pictures", "Pictures"), frame = element("div", { class: "pictures" });
    for (const { view, file, png } of report.pictures) {
      const shown = record(views.find(({ id }) => id === view)), glare = shown.glare;
      const note = file.startsWith("views/false_colour/") ? false_words(record(shown.false_colour)) : natural_words(shown);
      frame.append(element("figure", {}, element("figcaption", {}, view, element("span", {}, note)), element("img", { src: "data:image/png;base64," + png, alt: `View “${view}” in ${note}` }),
        glare && element("p", { class: "glare" }, `At the eye ${with_unit(number(glare.vertical_illuminance_lx, 4), "lx")} (Ev). DGP ${probability_words(glare)}. DGPs ${simplified_words(glare)}.`)));
    }
    part.append(frame);
  }

  // Data

  {
    const part = section("data", "Data");
    const link = element("a", { class: "button", download: "sensors.csv", href: URL.createObjectURL(new Blob([bytes_of(report.sensors_csv)], { type: "text/csv" })) }, "Save sensors.csv");
    part.append(element("p", { class: "no-print" }, link), element("p", { class: "note" }, `Every sensor with all components, as the run wrote it. Beside this page lie ${list(summary.files).join(", ")} and summary.json.`));
  }

  addEventListener("beforeprint", () => {
    for (const made of document.querySelectorAll("#basis details")) made.open = true;
  });
})();
