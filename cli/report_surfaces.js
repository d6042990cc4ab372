"use strict";
// The 3D view of a report: surfaces in the colours of one component of light, values where they are pointed at.
const report_surfaces = (() => {
  const { bytes_of, element, section, nothing, number, with_unit, place_text, plain, viridis, colour_of, scale_end, show_scale } = page;

  const components = [["total", "total"], ["sky", "sky (SC)"], ["sun", "sun"], ["erc", "outdoor surfaces (ERC)"], ["irc", "interreflection (IRC)"],
    ["daylight_factor", "daylight factor"]];
  const floats = (text) => new Float32Array(bytes_of(text).buffer);
  const integers = (text) => new Uint32Array(bytes_of(text).buffer);

  /** Components by name, the sums among them. */
  const light_of = (packed) => {
    const light = Object.fromEntries(Object.entries(packed).map(([name, text]) => [name, floats(text)]));
    light.erc = light.erc_ground.map((value, k) => value + light.erc_buildings[k]);
    light.total = light.erc.map((value, k) => value + light.sky[k] + light.sun[k] + light.irc[k]);
    return light;
  };

  /** What a report holds of surfaces, unpacked. */
  const unpack = (mesh) => ({
    ...mesh,
    faces: integers(mesh.faces), first: integers(mesh.first), outlines: integers(mesh.outlines), positions: floats(mesh.positions),
    colours: bytes_of(mesh.colours), light: light_of(mesh.light), patch_light: light_of(mesh.patch_light),
  });

  const place_of = (mesh, vertex) => [0, 1, 2].map((axis) => mesh.positions[3 * vertex + axis]);
  const minus = (a, b) => a.map((value, k) => value - b[k]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

  /** Mean-value coordinates (Floater 2003) of a place in the plane of a convex polygon: pictures are interpolated with them, too. */
  const weights_at = (corners, place) => {
    const n = corners.length, weights = new Array(n).fill(0), to = corners.map((corner) => minus(corner, place)), lengths = to.map((v) => Math.sqrt(dot(v, v)));
    let sum = 0;
    for (let i = 0; i < n; ++i) {
      const j = (i + 1) % n, size = lengths[i] * lengths[j];
      if (lengths[i] < 1e-6) return corners.map((_, k) => (k === i ? 1 : 0));
      const cosine = dot(to[i], to[j]), across = cross(to[i], to[j]), sine = Math.sqrt(dot(across, across));
      if (cosine < 0 && sine <= 1e-5 * size) {
        weights.fill(0);
        weights[i] = lengths[j] / (lengths[i] + lengths[j]);
        weights[j] = 1 - weights[i];
        return weights;
      }
      const tangent = sine / (size + cosine);
      weights[i] += tangent / lengths[i];
      weights[j] += tangent / lengths[j];
      sum += tangent / lengths[i] + tangent / lengths[j];
    }
    return sum > 0 ? weights.map((weight) => weight / sum) : weights.fill(1 / n);
  };

  /** Triangles of patches [begin, end), each with the middle of its patch as a corner; middles are appended to `made`. */
  const triangulate = (mesh, made, begin, end) => {
    const indices = [], patches = [];
    for (let patch = begin; patch < end; ++patch) {
      const outline = mesh.outlines.subarray(mesh.first[patch], mesh.first[patch + 1]);
      const push = (...triangle) => {
        indices.push(...triangle);
        patches.push(patch);
      };
      if (outline.length === 3) {
        push(...outline);
        continue;
      }
      const corners = Array.from(outline, (vertex) => place_of(mesh, vertex));
      const middle = [0, 1, 2].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / corners.length);
      const vertex = made.count + made.middles.length;
      made.middles.push({ place: middle, outline, weights: weights_at(corners, middle) });
      for (let k = 0; k < outline.length; ++k) push(vertex, outline[k], outline[(k + 1) % outline.length]);
    }
    return { indices, patches };
  };

  /**
   * Edges of patches [begin, end) as pairs of vertices: all, and those that no neighbour shares. Only indoor patches share
   * vertices; elsewhere those in one place count as one.
   */
  const edges_of = (mesh, begin, end, by_place) => {
    const count = mesh.positions.length / 3, shared = new Map(), first_at = new Map();
    const vertex_of = (vertex) => {
      if (!by_place) return vertex;
      const key = place_of(mesh, vertex).map((value) => Math.round(1e5 * value)).join();
      return first_at.get(key) ?? first_at.set(key, vertex).get(key);
    };
    for (let patch = begin; patch < end; ++patch)
      for (let k = mesh.first[patch]; k < mesh.first[patch + 1]; ++k) {
        const a = vertex_of(mesh.outlines[k]), b = vertex_of(mesh.outlines[k + 1 < mesh.first[patch + 1] ? k + 1 : mesh.first[patch]]);
        const key = Math.min(a, b) * count + Math.max(a, b);
        shared.set(key, (shared.get(key) || 0) + 1);
      }
    const all = [], outlines = [];
    for (const [key, times] of shared) {
      const pair = [Math.floor(key / count), key % count];
      all.push(...pair);
      if (times === 1) outlines.push(...pair);
    }
    return { all, outlines };
  };

  const linear_of = Float32Array.from({ length: 256 }, (_, k) => (k <= 10 ? k / 255 / 12.92 : ((k / 255 + 0.055) / 1.055) ** 2.4));
  const curved = (value) => (value <= 0.0031308 ? 12.92 * value : 1.055 * Math.min(value, 1) ** (1 / 2.4) - 0.055);

  /** Fills the section. Returns what makes the still picture for a print, if there is a model. */
  const draw = (report, part) => {
    if (!report.mesh) {
      part.append(nothing(`The scene has more than ${plain(report.most_patches_of_model)} patches, too many for a model in this page. scene.glb beside it holds the surfaces with their light and opens in 3D programs.`));
      return undefined;
    }
    const mesh = unpack(report.mesh);
    const has_factor = report.summary.outdoors?.horizontal_illuminance_lx > 0;
    const state = { component: has_factor ? "daylight_factor" : "total", colours: "false", scale: "linear", outdoors: false, grid: false };
    const offered = components.filter(([name]) => has_factor || name !== "daylight_factor");

    const select = (label, key, options) => {
      const made = element("select", {}, ...options.map(([value, text]) => element("option", { value }, text)));
      made.value = state[key];
      made.addEventListener("change", () => {
        state[key] = made.value;
        update();
      });
      return element("label", {}, label, made);
    };
    const checkbox = (label, key) => {
      const made = element("input", { type: "checkbox" });
      made.addEventListener("change", () => {
        state[key] = made.checked;
        update();
      });
      return element("label", {}, made, label);
    };
    const canvas = element("canvas", { class: "model", tabindex: "0", role: "application", "aria-label": "3D model: arrow keys turn it, plus and minus zoom, Enter reads the surface in the middle, Home resets the view" });
    const still = element("canvas", { class: "still", role: "img", "aria-label": "The model as it was last turned on the screen" });
    const space = element("div", { class: "space" }, canvas, element("div", { class: "cross" }), still);
    const bar = element("div", { class: "bar" }), ticks = element("div", { class: "ticks" }), caption = element("p", { class: "note" });
    const scale = element("div", { class: "scale" }, bar, ticks);
    const invitation = "Click a surface, or give the model the focus and press Enter.";
    const reading = element("p", { class: "reading", "aria-live": "polite" }, invitation);

    const attributes = { antialias: true, alpha: true, preserveDrawingBuffer: true };
    const context = mesh.first.length > 1 && (canvas.getContext("webgl2", attributes) || canvas.getContext("webgl", attributes));
    if (!context) {
      part.append(nothing(mesh.first.length < 2 ? "The scene has no surfaces." : "This browser shows no 3D graphics (WebGL is missing or switched off). Everything else on this page works, and scene.glb beside it opens in 3D programs."));
      return undefined;
    }
    const looks = element("select", {}, ...[["outside", "south-east, above"], ["opposite", "north-west, above"], ["plan", "plan"], ["inside", "middle of the room"]].map(([value, text]) => element("option", { value }, text)));
    part.append(
      element("p", { class: "note no-print" }, "Drag or use the arrow keys to turn the model, + and − to come nearer; the wheel zooms once the model has been clicked. On a touch screen tap the model first. Walls are seen from the room only: from outside one looks through them. Click a surface to read its values."),
      element("div", { class: "settings", role: "group", "aria-label": "What the model shows" },
        select("Light", "component", offered), select("Colours", "colours", [["false", "false colour"], ["natural", "natural"]]), select("Scale", "scale", [["linear", "linear"], ["logarithmic", "logarithmic"]]),
        element("label", {}, "Look from", looks), checkbox("patches", "grid"), checkbox("outdoor surfaces", "outdoors")),
      space, caption, scale, reading);

    // Geometry

    const made = { count: mesh.positions.length / 3, middles: [] };
    const parts = [["indoor", 0, mesh.indoor_patches], ["windows", mesh.indoor_patches, mesh.gather_patches], ["outdoor", mesh.gather_patches, mesh.faces.length]]
      .map(([name, begin, end]) => ({ name, ...triangulate(mesh, made, begin, end) }));
    const count = made.count + made.middles.length;
    const positions = new Float32Array(3 * count);
    positions.set(mesh.positions);
    made.middles.forEach((middle, k) => positions.set(middle.place, 3 * (made.count + k)));
    /** An array of the vertices with its middles added. */
    const with_middles = (values) => {
      const all = new Float32Array(count);
      all.set(values);
      made.middles.forEach(({ outline, weights }, k) => {
        let sum = 0;
        for (let c = 0; c < outline.length; ++c) sum += weights[c] * values[outline[c]];
        all[made.count + k] = sum;
      });
      return all;
    };
    const values_of = new Map();
    const values = (name) => values_of.get(name) || values_of.set(name, with_middles(mesh.light[name])).get(name);

    /** Channels of the colour under all light, 0 to 255 as on the screen. */
    const whole = [0, 1, 2].map((channel) => with_middles(mesh.colours.filter((_, k) => k % 3 === channel)));

    const position = new THREE.BufferAttribute(positions, 3), colour = new THREE.BufferAttribute(new Float32Array(3 * count), 3), place = new THREE.BufferAttribute(new Float32Array(2 * count), 2);
    // Of surfaces outdoors only the colour under all light is known: they keep it whatever the rooms show.
    const outdoor_colour = new THREE.BufferAttribute(new Uint8Array(3 * count), 3, true);
    for (let v = 0; v < count; ++v) for (let channel = 0; channel < 3; ++channel) outdoor_colour.array[3 * v + channel] = Math.round(whole[channel][v]);
    const geometry = (indices, attributes = {}) => {
      const it = new THREE.BufferGeometry();
      it.setAttribute("position", position);
      for (const [name, attribute] of Object.entries(attributes)) it.setAttribute(name, attribute);
      it.setIndex(new THREE.BufferAttribute(new Uint32Array(indices), 1));
      return it;
    };
    const ramp = element("canvas", { width: 256, height: 1 }), pen = ramp.getContext("2d");
    for (let k = 0; k < 256; ++k) {
      pen.fillStyle = colour_of(viridis, k / 255);
      pen.fillRect(k, 0, 1, 1);
    }
    const texture = new THREE.CanvasTexture(ramp);
    texture.minFilter = texture.magFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
    // Lines lie on the surfaces: those step back a little.
    const behind = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    const materials = {
      false: new THREE.MeshBasicMaterial({ map: texture, ...behind }),
      natural: new THREE.MeshBasicMaterial({ vertexColors: true, ...behind }),
      glass: new THREE.MeshBasicMaterial({ color: 0x9fcfe8, transparent: true, opacity: 0.3, depthWrite: false, ...behind }),
      line: new THREE.LineBasicMaterial({ color: 0x14181c, transparent: true, opacity: 0.75 }),
      thin: new THREE.LineBasicMaterial({ color: 0x14181c, transparent: true, opacity: 0.25 }),
    };
    const world = new THREE.Scene();
    const [indoor, windows, outdoor] = parts.map(({ name, indices, patches }) => {
      const attributes = { indoor: { color: colour, uv: place }, windows: {}, outdoor: { color: outdoor_colour } }[name];
      const it = new THREE.Mesh(geometry(indices, attributes), name === "windows" ? materials.glass : materials.natural);
      it.patches = patches;
      world.add(it);
      return it;
    });
    const inner_edges = edges_of(mesh, 0, mesh.indoor_patches, false), window_edges = edges_of(mesh, mesh.indoor_patches, mesh.gather_patches, true);
    const outer_edges = edges_of(mesh, mesh.gather_patches, mesh.faces.length, true);
    const lines = (pairs, material) => {
      const it = new THREE.LineSegments(geometry(pairs), material);
      world.add(it);
      return it;
    };
    lines([...inner_edges.outlines, ...window_edges.outlines], materials.line);
    const inner_grid = lines([...inner_edges.all, ...window_edges.all], materials.thin), outer_lines = lines(outer_edges.outlines, materials.line), outer_grid = lines(outer_edges.all, materials.thin);
    const mark = new THREE.Points(new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(new Float32Array(3), 3)),
      new THREE.PointsMaterial({ color: 0xd55e00, size: 9, sizeAttenuation: false, depthTest: false }));
    mark.visible = false;
    mark.frustumCulled = false;
    world.add(mark);

    // Camera

    const renderer = new THREE.WebGLRenderer({ canvas, context, ...attributes });
    // The colours of vertices and of the ramp are those of the screen already.
    if ("outputColorSpace" in renderer) renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    const camera = new THREE.PerspectiveCamera(40, 1, 0.01, 1000);
    camera.up.set(0, 0, 1);
    const controls = new THREE.OrbitControls(camera, canvas);
    controls.enableKeys = false;
    controls.enableZoom = false;  // until the model has the focus: a page that scrolls shall not stop here
    let focused = false;
    const inside = () => looks.value === "inside";
    const set_controls = () => {
      controls.enableZoom = focused && !inside();
      canvas.style.touchAction = focused ? "none" : "auto";
    };
    canvas.addEventListener("focus", () => {
      focused = controls.enabled = true;
      set_controls();
    });
    canvas.addEventListener("blur", () => {
      focused = false;
      set_controls();
    });
    // A finger that scrolls the page shall not turn the model: it taps it first.
    canvas.addEventListener("pointerdown", (event) => { controls.enabled = focused || event.pointerType !== "touch"; });
    set_controls();
    const box = new THREE.Box3();
    for (const vertex of mesh.outlines.subarray(0, mesh.first[mesh.gather_patches || mesh.faces.length]))
      box.expandByPoint(new THREE.Vector3(...place_of(mesh, vertex)));
    const centre = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3()), radius = Math.max(0.1, size.length() / 2);
    const panes = Array.from(mesh.outlines.subarray(mesh.first[mesh.indoor_patches], mesh.first[mesh.gather_patches]), (vertex) => place_of(mesh, vertex));
    const normal_of = (corners) => corners.slice(2).reduce((sum, corner, k) => cross(minus(corners[k + 1], corners[0]), minus(corner, corners[0])).map((value, axis) => sum[axis] + value), [0, 0, 0]);
    /** Distances to what a ray meets in the rooms. It starts some millimetres off: along the edges of patches, rays slip between triangles. */
    const distances = (from, direction) => new THREE.Raycaster(from.clone().add(new THREE.Vector3(0.0013, 0.0017, 0.0023)), direction).intersectObject(indoor).map((hit) => hit.distance);
    /** The middle of the room over the largest floor, half as high as the room; of the scene, where nothing is a floor. */
    const room_middle = () => {
      const floors = new Map();
      for (let patch = 0; patch < mesh.indoor_patches; ++patch) {
        const corners = Array.from(mesh.outlines.subarray(mesh.first[patch], mesh.first[patch + 1]), (vertex) => place_of(mesh, vertex));
        const normal = normal_of(corners), area = Math.hypot(...normal) / 2;
        if (normal[2] < 1.98 * area || !area) continue;
        const floor = floors.get(mesh.faces[patch]) || floors.set(mesh.faces[patch], { area: 0, sum: [0, 0, 0], patches: [] }).get(mesh.faces[patch]);
        const middle = [0, 1, 2].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / corners.length);
        floor.area += area;
        floor.sum = floor.sum.map((value, axis) => value + area * middle[axis]);
        floor.patches.push({ middle, radius: Math.max(...corners.map((corner) => Math.hypot(...minus(corner, middle)))) });
      }
      if (!floors.size) return centre.clone();
      const largest = [...floors.values()].reduce((a, b) => (b.area > a.area ? b : a)), centroid = largest.sum.map((value) => value / largest.area);
      const away = ({ middle }) => Math.hypot(...minus(middle, centroid)), nearest = largest.patches.reduce((a, b) => (away(b) < away(a) ? b : a));
      // The centroid of a floor with corners that turn inwards may lie outside of it.
      const start = new THREE.Vector3(...(away(nearest) <= nearest.radius ? centroid : nearest.middle));
      // A ceiling where people can stand, rather than the underside of a table.
      const over = distances(start, new THREE.Vector3(0, 0, 1));
      const height = over.find((distance) => distance >= 1.9) || over.at(-1) || 0;
      return start.setZ(start.z + height / 2);
    };
    const wider = (factor) => {
      camera.fov = Math.min(90, Math.max(20, camera.fov * factor));
      camera.updateProjectionMatrix();
    };
    let middle_of_room;
    const look_from = (name) => {
      const away = { outside: [0.75, -1, 0.9], opposite: [-0.75, 1, 0.9], plan: [0, -1e-3, 1] }[name];
      const narrow = Math.min(1, camera.aspect);
      controls.target.copy(centre);
      if (away && name !== "plan") controls.target.z -= 0.08 * radius;  // the nearer, lower edge looks larger
      if (away) camera.position.copy(controls.target).addScaledVector(new THREE.Vector3(...away).normalize(), radius / Math.sin(Math.PI / 9) / narrow * 0.92);
      else {
        // Towards the windows, the back to what stands opposite.
        const start = middle_of_room ||= room_middle();
        const to = [0, 1, 2].map((axis) => panes.reduce((sum, pane) => sum + pane[axis], 0) / panes.length - start.getComponent(axis));
        const ahead = panes.length && Math.hypot(to[0], to[1]) > 0.01 ? new THREE.Vector3(to[0], to[1], 0).normalize() : new THREE.Vector3(0, -1, 0);
        const [room_behind = 0] = distances(start, ahead.clone().negate());
        camera.position.copy(start).addScaledVector(ahead, -0.7 * room_behind);
        controls.target.copy(camera.position).addScaledVector(ahead, 0.01);
      }
      camera.fov = away ? 40 : 75;
      camera.near = radius / 500;
      camera.far = radius * 60;
      camera.updateProjectionMatrix();
      set_controls();
      controls.update();
    };
    let waiting = 0;
    const render = () => {
      waiting = 0;
      if (!context.isContextLost()) renderer.render(world, camera);
    };
    const render_soon = () => { waiting ||= requestAnimationFrame(render); };
    controls.addEventListener("change", render_soon);
    canvas.addEventListener("webglcontextrestored", render);
    canvas.addEventListener("wheel", (event) => {
      if (!focused || !inside()) return;
      event.preventDefault();
      wider(event.deltaY > 0 ? 1 / 0.95 : 0.95);
      render_soon();
    }, { passive: false });
    looks.addEventListener("change", () => {
      look_from(looks.value);
      render_soon();
    });
    const fit = () => {
      const width = canvas.clientWidth, height = canvas.clientHeight;
      if (!width || !height) return;
      renderer.setPixelRatio(Math.min(2, devicePixelRatio || 1));
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      render();
    };

    const dark = matchMedia("(prefers-color-scheme: dark)");
    const ink = (is_dark) => {
      for (const material of [materials.line, materials.thin]) material.color.set(is_dark ? 0xe6e9ed : 0x14181c);
    };
    dark.addEventListener("change", () => {
      ink(dark.matches);
      render_soon();
    });
    const make_still = () => {
      ink(false);
      render();
      still.width = canvas.width;
      still.height = canvas.height;
      still.getContext("2d").drawImage(canvas, 0, 0);
      ink(dark.matches);
      render();
    };

    // Colours

    let marked = -1;  // a patch
    const unmark = (words) => {
      marked = -1;
      mark.visible = false;
      for (const name of Object.keys(reading.dataset)) delete reading.dataset[name];
      reading.replaceChildren(words);
    };
    const update = () => {
      const chosen = values(state.component), natural = state.colours === "natural";
      const name = components.find(([key]) => key === state.component)[1], unit = state.component === "daylight_factor" ? "%" : "lx";
      scale.hidden = natural;
      if (natural) {
        // Of the colour under all light, the share of one component.
        const total = values("total");
        const is_part = state.component !== "total" && state.component !== "daylight_factor";
        for (let v = 0; v < count; ++v) {
          const share = !is_part ? 1 : total[v] > 0 ? chosen[v] / total[v] : 0;
          for (let channel = 0; channel < 3; ++channel) {
            const screen = whole[channel][v];
            colour.array[3 * v + channel] = share === 1 ? screen / 255 : curved(share * linear_of[Math.round(screen)]);
          }
        }
        colour.needsUpdate = true;
        caption.textContent = `Colours as in a picture exposed for the room: ${with_unit(number(mesh.white_cd_m2), "cd/m²")} is white; ${is_part ? `light of one kind alone, ${name}` : "all light"}.`;
      } else {
        const patches = mesh.patch_light[state.component].slice(0, mesh.indoor_patches).sort();
        const largest = scale_end(patches);
        const place_of_value = (value) => (state.scale === "linear" ? value / largest : value > 0 ? 1 + Math.log10(value / largest) / 3 : 0);
        for (let v = 0; v < count; ++v) place.array[2 * v] = (0.5 + 255 * Math.min(1, Math.max(0, place_of_value(chosen[v])))) / 256;
        place.needsUpdate = true;
        show_scale(bar, ticks, largest, unit, patches.at(-1) > largest, state.scale === "logarithmic");
        caption.textContent = `${name[0].toUpperCase()}${name.slice(1)} on surfaces, ${unit}; the brightest patch has ${with_unit(number(patches.at(-1) || 0), unit)}.`;
      }
      indoor.material = natural ? materials.natural : materials.false;
      outdoor.visible = outer_lines.visible = state.outdoors;
      outer_grid.visible = state.outdoors && state.grid;
      inner_grid.visible = state.grid;
      if (!state.outdoors && marked >= mesh.gather_patches) unmark(invitation);
      render();
    };

    // Values

    const caster = new THREE.Raycaster();
    const read_at = (x, y) => {
      camera.updateMatrixWorld();  // it may have moved since the last frame
      caster.setFromCamera({ x, y }, camera);
      const [hit] = caster.intersectObjects([indoor, windows, ...(state.outdoors ? [outdoor] : [])]);
      unmark(hit ? "" : "There is no surface that faces the room.");
      if (!hit) {
        render_soon();
        return;
      }
      mark.visible = true;
      mark.geometry.attributes.position.array.set(hit.point.toArray());
      mark.geometry.attributes.position.needsUpdate = true;
      const patch = marked = hit.object.patches[hit.faceIndex], face = mesh.face_names[mesh.faces[patch]];
      const point = hit.point.toArray(), where = point.map((value, axis) => value + mesh.origin_m[axis]);
      const title = element("strong", {}, `${face}, patch ${patch}, at (${place_text(where)}) m `);
      if (patch >= mesh.gather_patches) reading.replaceChildren(title, "A surface outdoors: its luminance is in scene.glb.");
      else {
        const outline = Array.from(mesh.outlines.subarray(mesh.first[patch], mesh.first[patch + 1]));
        const corners = outline.map((vertex) => place_of(mesh, vertex)), weights = weights_at(corners, point);
        const here = (name) => outline.reduce((sum, vertex, k) => sum + weights[k] * mesh.light[name][vertex], 0);
        const lx = (value) => with_unit(number(value, 4), "lx");
        const words_of = (value) => `${lx(value("total"))}: sky ${number(value("sky"))}, sun ${number(value("sun"))}, ground ${number(value("erc_ground"))}, buildings ${number(value("erc_buildings"))}, interreflection ${number(value("irc"))}`
          + (has_factor ? `; daylight factor ${with_unit(number(value("daylight_factor")), "%")}` : "") + ".";
        const distance = (vertex) => Math.hypot(...minus(place_of(mesh, vertex), point));
        const node = outline.filter((vertex) => vertex < mesh.nodes).sort((a, b) => distance(a) - distance(b))[0];
        reading.replaceChildren(title, `${words_of(here)} Mean of the patch: ${lx(mesh.patch_light.total[patch])}. `, node === undefined ? "" : `Nearest node: ${node}, ${words_of((name) => mesh.light[name][node])}`);
        Object.assign(reading.dataset, { patch, node: node ?? "", total: here("total"), place: where.join(" ") });
      }
      render_soon();
    };
    let pressed;
    canvas.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
    canvas.addEventListener("pointerup", (event) => {
      if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 5) return;
      const frame = canvas.getBoundingClientRect();
      canvas.focus({ preventScroll: true });
      read_at((2 * (event.clientX - frame.left)) / frame.width - 1, 1 - (2 * (event.clientY - frame.top)) / frame.height);
    });
    canvas.addEventListener("pointercancel", () => { pressed = undefined; });
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      const nearer = { "+": 0.9, "=": 0.9, "-": 1 / 0.9 }[event.key];
      const step = (5 * Math.PI) / 180, from = camera.position.clone().sub(controls.target);
      if (turn) {
        const round = Math.atan2(from.y, from.x) + turn[0] * step, down = Math.min(Math.PI - 0.02, Math.max(0.02, Math.acos(from.z / from.length()) + turn[1] * step));
        from.set(Math.sin(down) * Math.cos(round), Math.sin(down) * Math.sin(round), Math.cos(down)).multiplyScalar(camera.position.distanceTo(controls.target));
      } else if (nearer && inside()) wider(nearer);
      else if (nearer) from.multiplyScalar(nearer);
      else if (event.key === "Home") look_from(looks.value);
      else if (event.key === "Enter" || event.key === " ") read_at(0, 0);
      else return;
      event.preventDefault();
      if (turn || nearer) {
        camera.position.copy(controls.target).add(from);
        controls.update();
      }
      render_soon();
    });

    ink(dark.matches);
    fit();
    look_from("outside");
    update();
    new ResizeObserver(fit).observe(canvas);
    return make_still;
  };
  /** The section of the model. The rest of the page need not wait for its graphics. */
  return (report) => {
    const part = section("surfaces", "Surfaces in space");
    let drawn = false, make_still;
    const draw_once = () => {
      if (drawn) return;
      drawn = true;
      make_still = draw(report, part);
    };
    addEventListener("load", () => setTimeout(draw_once));
    addEventListener("beforeprint", () => {
      draw_once();
      make_still?.();
    });
  };
})();
