"use strict";
// What the scripts of pages share: words and numbers, pieces of a page, colours. Everything that stems from a scene enters a
// page as text, never as markup.
const page = (() => {
  const list = (value) => (Array.isArray(value) ? value : []);
  const record = (value) => (value && typeof value === "object" && !Array.isArray(value) ? value : {});
  const finite = (value) => typeof value === "number" && Number.isFinite(value);
  /** The bytes that a base64 text stands for. */
  const bytes_of = (text) => {
    const decoded = atob(text), bytes = new Uint8Array(decoded.length);
    for (let k = 0; k < decoded.length; ++k) bytes[k] = decoded.charCodeAt(k);
    return bytes;
  };

  // Words and numbers

  const group_digits = (text) => {
    const [whole, part] = text.split(".");
    const spaced = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
    return part === undefined ? spaced : spaced + "." + part;
  };
  /** Three significant digits, thousands apart, a true minus. */
  const number = (value, digits = 3) => {
    if (!finite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    let text;
    if (size >= 1e7 || size < 1e-4) {
      const [mantissa, power] = size.toExponential(digits - 1).split("e");
      const raised = String(Number(power)).replace(/./g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);
      text = mantissa + "·10" + raised;
    } else {
      const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
      text = group_digits(size.toFixed(Math.min(decimals, 8)));
    }
    return (value < 0 ? "−" : "") + text;
  };
  const signed = (value, digits = 3) => (finite(value) && value > 0 ? "+" : "") + number(value, digits);
  /** Without zeros at the end. */
  const plain = (value) => (finite(value) ? number(value, 4).replace(/(\.\d*?)0+(?=$|·)/, "$1").replace(/\.(?=$|·)/, "").replace(/^(−?)1·10/, "$110") : String(value));
  const with_unit = (text, unit) => (text === "–" ? text : text + "\u00a0" + unit);
  /** A place on an axis that is divided by `step`: with the decimals of the step, far from zero, too. */
  const stepped = (value, step) => {
    const text = group_digits(Math.abs(value).toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))));
    return value < 0 && /[1-9]/.test(text) ? "−" + text : text;
  };
  /** Metres to the millimetre, without zeros at the end. */
  const metres_text = (value) => (finite(value) ? stepped(value, 0.001).replace(/\.?0+$/, "") : "–");
  const place_text = (place) => list(place).map((value) => (finite(value) ? value.toFixed(2).replace("-", "−") : "–")).join(", ");
  /** A setting, whatever its type. */
  const setting_text = (value) =>
    value === undefined || value === null ? "–" : finite(value) ? plain(value) : typeof value === "object" ? JSON.stringify(value) : String(value);

  // Pieces of the page

  const element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) if (value !== undefined) made.setAttribute(name, value);
    made.append(...children.filter((child) => child !== undefined && child !== null));
    return made;
  };
  const svg = (tag, attributes = {}, ...children) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  };
  const main = document.getElementById("main");
  const contents = document.getElementById("contents");
  const section = (id, title, note) => {
    const heading = element("h2", { id: id + "-title" }, title);
    const made = element("section", { id, "aria-labelledby": id + "-title" }, heading);
    if (note) made.append(element("p", { class: "note" }, note));
    main.append(made);
    contents.append(element("li", {}, element("a", { href: "#" + id }, title)));
    return made;
  };
  /**
   * A table in a frame that scrolls. columns: {head, words, long}; rows: {cells, class}, the first cell of a row is its heading.
   */
  const table = (caption, columns, rows, tall) => {
    const head = element("tr", {}, ...columns.map((column, k) =>
      element("th", { scope: "col", class: column.words && k > 0 ? "words" : undefined }, column.head)));
    const body = rows.map((row) => element("tr", { class: row.class }, ...row.cells.map((cell, k) => k === 0
      ? element("th", { scope: "row" }, cell)
      : element("td", { class: columns[k].long ? "words long" : columns[k].words ? "words" : undefined }, cell))));
    const body_element = element("tbody");
    for (const row of body) body_element.append(row);  // there may be more than a call takes arguments
    const made = element("table", {}, element("caption", {}, caption), element("thead", {}, head), body_element);
    return element("div", { class: tall ? "scroll tall" : "scroll", tabindex: "0", role: "region", "aria-label": caption }, made);
  };
  const details = (summary, ...children) => element("details", {}, element("summary", {}, summary), ...children);
  const nothing = (text) => element("p", { class: "none" }, text);

  // Colours and scales

  const viridis = [[68, 1, 84], [72, 40, 120], [62, 73, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [110, 206, 88], [181, 222, 43], [253, 231, 37]];
  const colour_of = (anchors, place) => {
    const at = Math.min(Math.max(place, 0), 1) * (anchors.length - 1), first = Math.min(Math.floor(at), anchors.length - 2);
    return `rgb(${anchors[first].map((value, k) => Math.round(value + (at - first) * (anchors[first + 1][k] - value))).join(",")})`;
  };
  const round_up = (value) => {
    if (!(value > 0)) return 1;
    const power = 10 ** Math.floor(Math.log10(value));
    return ([1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8].find((digit) => digit * power >= value * (1 - 1e-12)) || 10) * power;
  };
  /**
   * Where a scale of ordered values ends, rounded up: their 99th percentile, or five times their median where that is less, as for the
   * automatic exposure of pictures. Reveals and spots of sun would leave one colour to the rest of the room.
   */
  const scale_end = (ordered) => round_up(Math.min(ordered[Math.floor(((ordered.length - 1) * 99) / 100)], 5 * ordered[ordered.length >> 1]) || ordered.at(-1) || 0);
  /** Round values from 0 to `largest`, at most `most` steps. */
  const round_steps = (largest, most) => {
    const power = 10 ** Math.floor(Math.log10(largest / most));
    const step = [1, 2, 5, 10].map((digit) => digit * power).find((value) => largest / value <= most * (1 + 1e-9));
    return Array.from({ length: Math.floor(largest / step + 1e-9) + 1 }, (_, k) => k * step);
  };
  /** A legend of viridis from 0 to `largest`: linear, or over three decades. cut: whether there are values beyond. */
  const show_scale = (bar, ticks, largest, unit, cut, logarithmic) => {
    bar.style.background = `linear-gradient(to right, ${viridis.map((_, k) => colour_of(viridis, k / (viridis.length - 1))).join(",")})`;
    let values = logarithmic ? [0.001, 0.01, 0.1, 1].map((share) => share * largest) : round_steps(largest, 5);
    // The end is always told. A step just below it would run into its label.
    if (values.at(-1) < 0.999 * largest) values = [...values.filter((value) => value <= 0.8 * largest), largest];
    ticks.replaceChildren(...values.map((value) => {
      const at = logarithmic ? 1 + Math.log10(value / largest) / 3 : value / largest, last = at > 0.999;
      const tick = element("span", {}, last ? `${cut ? "≥\u00a0" : ""}${with_unit(plain(value), unit)}` : plain(value));
      tick.style.left = 100 * at + "%";
      tick.style.transform = at < 1e-3 ? "none" : last ? "translateX(-100%)" : "";
      return tick;
    }));
  };

  return {
    list, record, finite, bytes_of, number, signed, plain, stepped, metres_text, with_unit, place_text, setting_text, element, svg, main, section, table,
    details, nothing, viridis, colour_of, round_up, scale_end, round_steps, show_scale,
  };
})();
