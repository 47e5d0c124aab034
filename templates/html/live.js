// A model that moves by its own equations: the motion goes to a stage (plane.js or space.js), to plots, and into the address.
"use strict";

const KEPT = 240; // instants that a path shows
const CURVE = 3000; // points of a curve at most
const FRAME = 1 / 60; // s
const BUSY = 12; // ms in which a frame is computed
const BOW = 21; // points of a rope on a wheel
const TURN = 0.5; // rad by which an angle changes at most in a step towards the pointer
const TINY = 1e-6; // by which coordinates are varied where a body is dragged, of 1 rad or m

// The places of bodies and strands as the stages read them, an instant a row; the last row is now.
function livePicture(data) {
  const bodies = data.seen ? data.seen.across.length : data.bodies.length, wide = data.seen ? 3 : 7, high = data.seen ? 2 : 3;
  const counts = data.seen ? data.seen.courses.map((each) => each.reduce((sum, { turn, turns }) => sum + (turn ? BOW * (1 + turns) : 1), 0)) : data.counts;
  const before = (k) => counts.slice(0, k).reduce((sum, count) => sum + count, 0), packed = (columns) => ({ values: new Float64Array(KEPT * columns), columns });
  const poses = packed(wide * bodies), ropes = packed(high * before(counts.length)), middles = data.middles ? packed(2) : null;
  data.pieces = counts.map((count, k) => [high * before(k), count]);
  Object.assign(data, { poses, ropes, middles, times: Array.from({ length: KEPT }, (_, k) => k) });

  const page = (p) => data.seen.sides.map((side) => side[0] * p[0] + side[1] * p[1] + side[2] * p[2]);
  function onPage(pose, body) { // place and angle
    const w = data.seen.across[body], [dx, dy] = data.seen.shifts[body], [x, y] = page(pose.slice(9));
    const way = page([0, 3, 6].map((k) => pose[k] * w[0] + pose[k + 1] * w[1] + pose[k + 2] * w[2]));
    return [x + dx, y + dy, Math.atan2(way[1], way[0])];
  }
  function inSpace(m) { // place and quaternion x, y, z, w of a rotation by rows
    const trace = m[0] + m[4] + m[8], found = [0, 1, 2].map((k) => 1 + 2 * m[4 * k] - trace);
    const large = [1 + trace, ...found], best = large.indexOf(Math.max(...large)), s = 2 * Math.sqrt(large[best]);
    const q = [
      () => [(m[7] - m[5]) / s, (m[2] - m[6]) / s, (m[3] - m[1]) / s, s / 4],
      () => [s / 4, (m[1] + m[3]) / s, (m[2] + m[6]) / s, (m[7] - m[5]) / s],
      () => [(m[1] + m[3]) / s, s / 4, (m[5] + m[7]) / s, (m[2] - m[6]) / s],
      () => [(m[2] + m[6]) / s, (m[5] + m[7]) / s, s / 4, (m[3] - m[1]) / s],
    ][best]();
    return [m[9], m[10], m[11], ...q];
  }
  const placed = ([flat]) => Array.from({ length: bodies }, (_, k) => {
    const pose = flat.slice(12 * k, 12 * k + 12);
    return data.seen ? onPage(pose, k) : inSpace(pose);
  });
  // A rope on the page as the figure lays it: tangent to wheels of a radius (negative to the right of its way), bows between.
  function laid(course, now) {
    const centres = course.map(({ body, at: [x, y] }) => {
      if (body < 0) return [x, y];
      const [hx, hy, first] = data.home[body], [px, py, turn] = now[body], c = Math.cos(turn - first), s = Math.sin(turn - first);
      return [px + c * (x - hx) - s * (y - hy), py + s * (x - hx) + c * (y - hy)];
    });
    const pieces = course.slice(1).map(({ turn: second }, k) => {
      const first = course[k].turn, [ax, ay] = centres[k], [bx, by] = centres[k + 1], apart = Math.hypot(bx - ax, by - ay);
      if (apart <= Math.abs(second - first) || apart === 0) return [[ax, ay], [bx, by]];
      const turned = Math.atan2(by - ay, bx - ax) + Math.acos((second - first) / apart), n = [Math.cos(turned), Math.sin(turned)];
      return [[ax - first * n[0], ay - first * n[1]], [bx - second * n[0], by - second * n[1]]];
    });
    return course.flatMap(({ turn, turns }, k) => {
      const ends = [(pieces[k - 1] || [])[1], (pieces[k] || [])[0]].filter(Boolean), [cx, cy] = centres[k];
      if (!turn) return ends[0];
      const [first, last] = [ends[0], ends[ends.length - 1]].map(([x, y]) => Math.atan2(y - cy, x - cx)), whole = 2 * Math.PI;
      const side = Math.sign(turn), way = side * (last - first), angle = side * (way - whole * Math.floor(way / whole) + whole * turns);
      const count = BOW * (1 + turns), radius = Math.abs(turn);
      return Array.from({ length: count }, (_, i) => first + angle * i / (count - 1)).flatMap((a) => [cx + radius * Math.cos(a), cy + radius * Math.sin(a)]);
    });
  }
  const strands = ([, flat], now) => (data.seen ? data.seen.courses.flatMap((course) => laid(course, now)) : flat);
  let filled = 0;
  return {
    placed,
    get first() { return KEPT - Math.max(1, filled); },
    forget() { filled = 0; },
    write(picture, anew) { // as the next instant, or in place of the last
      const now = placed(picture), lines = strands(picture, now);
      for (const [each, row] of [[poses, now.flat()], [ropes, lines], ...(middles ? [[middles, mean(now)]] : [])]) {
        if (anew) each.values.copyWithin(0, each.columns);
        each.values.set(row, (KEPT - 1) * each.columns);
      }
      if (anew || !filled) filled = Math.min(KEPT, filled + 1);
    },
  };
  function mean(now) {
    return [0, 1].map((k) => now.reduce((sum, pose) => sum + pose[k], 0) / bodies);
  }
}

// Return coordinates at which a point is nearer to a goal on the page: by the least change, angles by at most TURN; null for none.
function towards(q, seen, goal, turns) {
  const at = seen(q), miss = [goal[0] - at[0], goal[1] - at[1]];
  const columns = q.map((x, k) => {
    const next = seen(q.map((old, i) => (i === k ? x + TINY : old)));
    return [(next[0] - at[0]) / TINY, (next[1] - at[1]) / TINY];
  });
  const sum = (i, j) => columns.reduce((total, column) => total + column[i] * column[j], 0);
  let [a, b, c] = [sum(0, 0), sum(0, 1), sum(1, 1)];
  const soft = 1e-3 * (a + c) + 1e-12;
  [a, c] = [a + soft, c + soft];
  const det = a * c - b * b, y = [(c * miss[0] - b * miss[1]) / det, (a * miss[1] - b * miss[0]) / det];
  const change = columns.map((column) => column[0] * y[0] + column[1] * y[1]);
  const widest = Math.max(TURN, ...change.filter((_, k) => turns[k]).map(Math.abs));
  for (let part = TURN / widest, tries = 0; tries < 8; part /= 2, tries++) {
    const next = q.map((x, k) => x + part * change[k]), there = seen(next);
    if (Math.hypot(goal[0] - there[0], goal[1] - there[1]) < Math.hypot(...miss)) return next;
  }
  return null;
}

// A curve, or several over the same values, with ticks at the ends of both ranges.
function liveCurve(canvas) {
  const number = (x) => String(Number(x.toPrecision(3)));
  return (across, curves, colours) => {
    const wide = canvas.clientWidth, high = canvas.clientHeight, ratio = window.devicePixelRatio || 1, pen = canvas.getContext("2d");
    if (canvas.width !== Math.round(wide * ratio)) [canvas.width, canvas.height] = [Math.round(wide * ratio), Math.round(high * ratio)];
    const style = getComputedStyle(canvas), [left, low] = [52, 20];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, wide, high);
    const ends = (rows) => {
      let [least, most] = [Infinity, -Infinity];
      for (const row of rows) for (const x of row) if (Number.isFinite(x)) [least, most] = [Math.min(least, x), Math.max(most, x)];
      if (!(least <= most)) return [0, 1];
      const air = most - least > 1e-9 * Math.max(Math.abs(least), Math.abs(most)) ? 0.04 * (most - least) : 0.5 * Math.abs(most) || 0.5;
      return [least - air, most + air];
    };
    const [x0, x1] = ends([across]), [y0, y1] = ends(curves);
    const px = (x) => left + (x - x0) / (x1 - x0) * (wide - left - 6), py = (y) => high - low - (y - y0) / (y1 - y0) * (high - low - 6);
    pen.strokeStyle = pen.fillStyle = style.color;
    pen.font = "12px system-ui, sans-serif";
    pen.lineWidth = 1;
    pen.strokeRect(left, 6, wide - left - 6, high - low - 6);
    pen.textAlign = "right";
    pen.fillText(number(y1), left - 5, 16);
    pen.fillText(number(y0), left - 5, high - low);
    pen.fillText(number(x1), wide - 6, high - 5);
    pen.textAlign = "left";
    pen.fillText(number(x0), left, high - 5);
    curves.forEach((row, k) => {
      pen.strokeStyle = colours[k];
      pen.lineWidth = 1.6;
      pen.beginPath();
      row.forEach((y, i) => pen.lineTo(px(across[i]), py(y)));
      pen.stroke();
      const last = row.length - 1;
      if (curves.length === 1 && last >= 0) pen.fillRect(px(across[last]) - 3, py(row[last]) - 3, 6, 6);
    });
  };
}

function live(root, makeStage) {
  const data = JSON.parse(root.querySelector(".live-data").textContent), names = data.model;
  const picture = livePicture(data), frame = root.querySelector(".stage"), stage = makeStage(frame, data);
  const button = (name) => root.querySelector(`[data-do=${name}]`), speed = root.querySelector("[data-for=speed]");
  const said = root.querySelector(".said"), output = root.querySelector("output");
  const isOn = (name) => button(name).getAttribute("aria-pressed") === "true";
  const declared = (kind, key) => names[kind].map((entry) => entry[key]);
  const INKS = ["#0b5cad", "#c2410c", "currentColor"];
  let parameters = declared("parameters", "value"), moves = null, playing = false, before = 0, record = [], held = parameters;

  // Parameters that depend on others follow them.
  function followed(values) {
    const next = PROGRAMS.follow(0, [], [], values, [], [])[0];
    return values.map((old, k) => (data.followers.includes(k) ? next[data.followers.indexOf(k)] : old));
  }
  // A declared stop ends the motion, also one that begins where its condition holds.
  if (names.mode_ends.length) {
    const events = PROGRAMS.events;
    PROGRAMS.events = (...given) => [events(...given)[0].slice(0, names.mode_ends.length)];
  }
  const holding = () => (names.mode_ends.length ? names.mode_ends.find((_, k) => moves.value("events")[0][k] > 0) : undefined);

  // Begin a motion at a time and a state, which is put onto the constraints; without one the last one goes on.
  function begin(t, q, u) {
    try {
      if (data.positive.some((k) => !(parameters[k] > 0))) throw new Error("not positive");
      const next = motion(names, { parameters, t, initial: { q, u } });
      const rates = next.value("state_derivative").flat();
      if (![...next.q, ...next.u, ...rates, ...next.value("picture").flat()].every(Number.isFinite)) throw new Error("no motion");
      [moves, held] = [next, parameters];
      said.textContent = "";
      return true;
    } catch {
      parameters = held;
      said.textContent = "With that value there is no motion: the one before holds.";
      return false;
    }
  }
  function restart() {
    parameters = declared("parameters", "value");
    record = [];
    picture.forget();
    begin(0, declared("coordinates", "initial"), declared("speeds", "initial"));
    draw(true);
    share();
  }

  // Quantities that can be shown: time, coordinates, speeds, outputs, energies.
  const of = (kind, key) => names[kind].map((entry, k) => ({ ...entry, runs: data.runs[entry.name], at: () => moves[key][k] }));
  const energy = (...parts) => () => { const both = moves.value("energy").flat(); return parts.reduce((sum, k) => sum + both[k], 0); };
  const plain = (name, unit, at) => ({ name, unit, runs: [[name, ""]], at });
  const quantities = [
    plain("time", "s", () => moves.t), ...of("coordinates", "q"), ...of("speeds", "u"),
    ...data.outputs.map((entry, k) => ({ ...entry, runs: data.runs[entry.name], at: () => moves.value("outputs")[0][k] })),
    plain("kinetic energy", "J", energy(0)), plain("potential energy", "J", energy(1)), plain("total energy", "J", energy(0, 1)),
  ];
  const energies = [0, quantities.length - 1, quantities.length - 3, quantities.length - 2];
  const [left, right] = root.querySelectorAll(".plots figure");
  const curves = [left, right].map((figure) => liveCurve(figure.querySelector("canvas")));
  const choices = [1, 1 + names.coordinates.length].map((chosen, k) => {
    const label = document.createElement("label"), select = document.createElement("select");
    quantities.forEach(({ name, unit }, i) => select.add(new Option(unit && unit !== "1" ? `${name} [${unit}]` : name, String(i))));
    select.value = String(Math.min(chosen, quantities.length - 1));
    select.addEventListener("change", draw);
    label.append(k ? "up " : "across ", select);
    right.querySelector("figcaption").append(label);
    return select;
  });
  ["total", "kinetic", "potential"].forEach((word, k) => {
    const entry = document.createElement("span"), line = document.createElement("i");
    line.style.borderTopColor = INKS[[2, 0, 1][k]];
    entry.append(line, `${word} energy [J]`);
    left.querySelector("figcaption").append(entry);
  });

  // A slider and a number for a parameter or a coordinate.
  function setting(panel, { name, unit, value }, reach, change) {
    const row = document.createElement("div"), label = document.createElement("label"), range = document.createElement("input");
    const number = document.createElement("input"), told = document.createElement("span");
    row.className = "setting";
    label.append(...typeset(data.runs[name]));
    Object.assign(range, { type: "range", min: reach[0], max: reach[1], step: "any", value });
    Object.assign(number, { type: "number", step: "any", value });
    for (const each of [range, number]) {
      each.setAttribute("aria-label", name);
      each.addEventListener("input", () => { if (Number.isFinite(each.valueAsNumber)) change(each.valueAsNumber); });
    }
    told.textContent = unit === "1" ? "" : unit;
    row.append(label, range, number, told);
    panel.append(row);
    return (x) => {
      if (document.activeElement !== range) range.value = x;
      if (document.activeElement !== number) number.value = Number(x.toPrecision(6));
    };
  }
  const around = (x) => (x > 0 ? [0.05 * x, 3 * x] : x < 0 ? [3 * x, 0.05 * x] : [-1, 1]);
  const ofParameters = data.shown.map((k) => setting(root.querySelector(".parameters"), names.parameters[k], around(names.parameters[k].value), (x) => {
    parameters = followed(parameters.map((old, i) => (i === k ? x : old)));
    changed(moves.q, moves.u);
  }));
  root.querySelector(".parameters").hidden = !data.shown.length;
  const state = [...names.coordinates.map((entry) => [entry, "q"]), ...names.speeds.map((entry) => [entry, "u"])];
  const offset = { q: 0, u: names.coordinates.length };
  const ofState = state.map(([entry, key], place) => {
    const x = entry.initial, wide = Math.max(entry.unit === "rad" ? Math.PI : 1, 2 * Math.abs(x));
    return setting(root.querySelector(".state"), { ...entry, value: x }, [-wide, wide], (value) => {
      const now = { q: moves.q, u: moves.u };
      now[key][place - offset[key]] = value;
      changed(now.q, now.u);
    });
  });
  function changed(q, u) {
    picture.forget();
    record = [];
    draw(begin(moves.t, q, u));
    share();
  }

  function note() {
    if (record.length >= CURVE) record = record.filter((_, k) => k % 2);
    record.push(quantities.map(({ at }) => at()));
  }
  function draw(anew = false) {
    picture.write(moves.value("picture"), anew === true);
    if (anew === true) note();
    stage.show(KEPT - 1, KEPT - 1, 0, { first: picture.first, fades: true, shown: data.traces.map(() => isOn("trails")) });
    const column = (k) => record.map((row) => row[k]), ink = getComputedStyle(root).color;
    curves[0](column(0), energies.slice(1).map(column), [ink, INKS[0], INKS[1]]);
    curves[1](column(Number(choices[0].value)), [column(Number(choices[1].value))], [INKS[0]]);
    output.textContent = "t = " + moves.t.toFixed(2) + " s";
    ofParameters.forEach((show, k) => show(parameters[data.shown[k]]));
    [...moves.q, ...moves.u].forEach((x, k) => ofState[k](x));
  }
  // Go on by some seconds; what takes longer than a frame has is left out.
  function go(seconds) {
    const stop = holding();
    if (stop !== undefined) {
      play(false);
      said.textContent = "The condition of " + stop + " holds here: the motion ends.";
      return draw();
    }
    try {
      moves.advance(moves.t + seconds, Date.now() + BUSY);
      if (![...moves.q, ...moves.u].every(Number.isFinite)) throw new Error("not finite");
    } catch {
      play(false);
      said.textContent = "The motion cannot go on from here: its steps become too small.";
    }
    if (moves.ended) {
      play(false);
      said.textContent = "The motion ends here: " + moves.ended;
    }
    draw(true);
  }
  function step(now) {
    if (!playing) return;
    const started = performance.now();
    go(Math.min(0.1, (now - before) / 1000) * Number(speed.value));
    before = now;
    root.dataset.frames = String(Number(root.dataset.frames || 0) + 1);
    root.dataset.busy = String(performance.now() - started);
    if (playing) requestAnimationFrame(step);
  }
  function play(on) {
    if (playing === on) return;
    playing = on;
    button("play").textContent = on ? "Pause" : "Start";
    if (!on) return share();
    before = performance.now();
    requestAnimationFrame(step);
  }
  function turn(name, on = !isOn(name)) {
    button(name).setAttribute("aria-pressed", String(on));
    if (stage.switches[name]) stage.switches[name](on);
    draw();
  }

  // The state in the address: parameters that differ, the time, coordinates and speeds.
  function share() {
    const words = new URLSearchParams();
    names.parameters.forEach(({ name, value }, k) => {
      if (parameters[k] !== value && !data.followers.includes(k)) words.set("p." + name, parameters[k]);
    });
    if (moves && moves.t + Math.abs(moves.q.reduce((sum, x, k) => sum + Math.abs(x - names.coordinates[k].initial), 0)) > 0) {
      words.set("t", moves.t);
      words.set("q", moves.q.join(" "));
      words.set("u", moves.u.join(" "));
    }
    try { history.replaceState(null, "", words.size ? "#" + words : location.pathname + location.search); } catch { /* a frame without an address */ }
  }
  function shared() {
    const words = new URLSearchParams(location.hash.slice(1)), numbers = (key) => (words.get(key) || "").split(" ").map(Number);
    names.parameters.forEach(({ name }, k) => {
      const value = Number(words.get("p." + name));
      if (words.has("p." + name) && Number.isFinite(value)) parameters[k] = value;
    });
    const [q, u] = [numbers("q"), numbers("u")], fits = q.length === names.coordinates.length && u.length === names.speeds.length;
    parameters = followed(parameters);
    if (words.has("q") && fits && [...q, ...u].every(Number.isFinite)) return begin(Math.max(0, Number(words.get("t")) || 0), q, u);
    return begin(0, declared("coordinates", "initial"), declared("speeds", "initial"));
  }

  // A body that is dragged takes its mechanism along: the least change of coordinates that brings the point there.
  function hold(event) {
    const held = event.target.closest && event.target.closest("g[data-body]");
    if (!held || !data.seen || event.button > 0) return;
    event.stopPropagation();
    event.preventDefault();
    const body = Number(held.dataset.body), scene = frame.querySelector("svg > g"), going = playing;
    const onPage = ({ clientX, clientY }) => {
      const at = new DOMPoint(clientX, clientY).matrixTransform(scene.getScreenCTM().inverse());
      return [at.x, data.height - at.y];
    };
    const place = (q) => {
      const [x, y, turn] = picture.placed(moves.value("picture", q))[body], [c, s] = [Math.cos(turn), Math.sin(turn)];
      return { x, y, c, s };
    };
    const [gx, gy] = onPage(event), pose = place(moves.q), [dx, dy] = [gx - pose.x, gy - pose.y];
    const own = [pose.c * dx + pose.s * dy, pose.c * dy - pose.s * dx];
    const seen = (q) => { const { x, y, c, s } = place(q); return [x + c * own[0] - s * own[1], y + s * own[0] + c * own[1]]; };
    play(false);
    frame.classList.add("held");
    frame.setPointerCapture(event.pointerId);
    const move = (next) => { reach(seen, onPage(next)); draw(); };
    const release = () => {
      frame.classList.remove("held");
      frame.removeEventListener("pointermove", move);
      changed(moves.q, moves.u.map(() => 0));
      if (going) play(true);
    };
    frame.addEventListener("pointermove", move);
    frame.addEventListener("lostpointercapture", release, { once: true });
  }
  function reach(seen, goal) {
    const turns = names.coordinates.map(({ unit }) => unit === "rad");
    for (let round = 0; round < 4; round++) {
      const next = towards(moves.q, seen, goal, turns);
      if (!next || !begin(moves.t, next, moves.u.map(() => 0))) return;
    }
  }

  const commands = {
    play: () => play(!playing),
    step: () => { play(false); go(FRAME); share(); },
    restart: () => { play(false); restart(); },
    trails: () => turn("trails"),
    names: () => turn("names"),
    follow: () => turn("follow"),
    view: () => { stage.reset(); draw(); },
    link: async () => {
      share();
      try { await navigator.clipboard.writeText(location.href); said.textContent = "The address is copied."; }
      catch { said.textContent = "The address of this page holds its state."; }
    },
  };
  const keys = { " ": "play", ".": "step", r: "restart", t: "trails", n: "names", v: "follow" };
  function press(event) {
    const command = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    const taken = event.target.matches("select, input, summary") || (event.key === " " && event.target.matches("button"));
    if (!command || taken || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    commands[command]();
  }
  for (const each of root.querySelectorAll("[data-do]")) each.addEventListener("click", commands[each.dataset.do]);
  for (const name of Object.keys(stage.switches)) button(name).hidden = false;
  frame.addEventListener("pointerdown", hold, { capture: true });
  (document.querySelector("main.alone") ? document : root).addEventListener("keydown", press);
  const again = () => { stage.recolour(); draw(); };
  window.addEventListener("resize", again);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  root.model = { advance: (to) => moves.advance(to), get t() { return moves.t; }, get q() { return moves.q; }, get u() { return moves.u; } };
  if (shared()) draw(true);
  else restart();
}
