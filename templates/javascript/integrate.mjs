/* Integrates model.mjs from the start in names.json by Dormand and Prince's method of order 5, with adaptive steps.
 *
 *     node integrate.mjs [end of time in s] [relative tolerance]
 *
 * Each step is put back onto the constraints, positions first. Contacts, stops and friction stay in the state of the
 * start, which names.json has under `mode`; the motion ends where that state does. In a browser import `simulate`. */
import { PROGRAMS } from "./model.mjs";

const NODES = [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1];
const STAGES = [
    [],
    [1 / 5],
    [3 / 40, 9 / 40],
    [44 / 45, -56 / 15, 32 / 9],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
];
const ERROR = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40];
const ITERATIONS = 5; /* of a state towards the constraints */
const APART = 1e-6; /* by which a state may miss the constraints at the start */
const ROUNDED = 1e-9; /* part of its largest value by which a function that ends the motion may exceed zero */
const HALVINGS = 50; /* of a step in which the motion ends */
const MOST_STEPS = 1e7;

const beside = (x, h, rate) => x.map((a, k) => a + h * rate[k]);

/* The model with its parameters; `inputs(t, q, u)` gives other inputs than the declared ones. */
function model(names, parameters, inputs) {
    const nq = names.coordinates.length, ends = names.mode_ends || [];
    const given = inputs || ((t, q, u) => PROGRAMS.inputs(t, q, u, parameters)[0]);
    const asked = (name, t, x) => {
        const q = x.slice(0, nq), u = x.slice(nq);
        return PROGRAMS[name](t, q, u, parameters, given(t, q, u), []);
    };
    const rates = (t, x) => {
        const [qdot, udot] = asked("state_derivative", t, x);
        return [...qdot, ...udot];
    };
    const kept = (t, x) => {
        if (PROGRAMS.normalize) x = [...asked("normalize", t, x)[0], ...x.slice(nq)];
        if (!PROGRAMS.project_position) return x;
        for (let k = 0; k < ITERATIONS; k++)
            x = [...beside(x.slice(0, nq), 1.0, asked("project_position", t, x)[1]), ...x.slice(nq)];
        return [...x.slice(0, nq), ...beside(x.slice(nq), 1.0, asked("project_velocity", t, x)[1])];
    };
    const largest = ends.map(() => 0.0);
    /* The number of the function that ends the motion at a state; -1 for none. */
    const ending = (t, x) => {
        const values = ends.length ? asked("events", t, x)[0].slice(-ends.length) : [];
        values.forEach((value, k) => (largest[k] = Math.max(largest[k], Math.abs(value))));
        return values.findIndex((value, k) => value > ROUNDED * Math.max(1.0, largest[k]));
    };
    return { nq, ends, asked, rates, kept, ending, largest };
}

/* A step over h: the state at its end and the error in units of the tolerances. */
function step({ rates, kept }, t, x, first, h, rtol, atol) {
    const k = [first];
    let end = x;
    for (let i = 1; i < NODES.length; i++) {
        end = x.map((a, n) => a + h * STAGES[i].reduce((sum, weight, j) => sum + weight * k[j][n], 0.0));
        k.push(rates(t + NODES[i] * h, end));
    }
    const squares = end.map((b, n) => {
        const error = h * ERROR.reduce((sum, weight, j) => sum + weight * k[j][n], 0.0);
        return (error / (atol + rtol * Math.max(Math.abs(x[n]), Math.abs(b)))) ** 2;
    });
    const error = Math.sqrt(squares.reduce((sum, a) => sum + a, 0.0) / Math.max(1, squares.length));
    return [kept(t + h, end), error];
}

/* A motion from the start in names.json: `advance(to)` integrates as far as time `to`, and returns whether it came there
   before `Date.now()` passes `deadline`; `t`, `q`, `u` are where it is, `ended` why it is over. `value(name)` is what a
   program returns there, or at other coordinates. Options: `rtol`, `atol`, `parameters`, `inputs(t, q, u)`, `t`,
   `initial` as { q, u }, the first step `first`. */
export function motion(names, options = {}) {
    const { rtol = 1e-9, atol = 0.1 * rtol, inputs = null, first = 1e-3 } = options;
    const { parameters = names.parameters.map((entry) => entry.value) } = options;
    const initial = (kind) => names[kind].map((entry) => entry.initial);
    const { q = initial("coordinates"), u = initial("speeds") } = options.initial || {};
    const system = model(names, parameters, inputs);
    let t = options.t || 0.0, x = system.kept(t, [...q, ...u]), h = first, steps = 0, ended = "", number;
    const open = PROGRAMS.project_position ? system.asked("project_position", t, x)[1] : [];
    if (open.some((part) => !(Math.abs(part) < APART))) throw new Error("no state near this one fulfils the constraints");
    while ((number = system.ending(t, x)) >= 0) system.largest[number] = Infinity; /* at the start it tells nothing */

    /* Go as far as the state lasts in a step over `used`, in which it ends. */
    function last(slope, used, found) {
        const reached = (part) => step(system, t, x, slope, part, rtol, atol)[0];
        let [low, high] = [0.0, used];
        for (let k = 0; k < HALVINGS; k++) {
            const middle = 0.5 * (low + high);
            if (system.ending(t + middle, reached(middle)) >= 0) high = middle;
            else low = middle;
        }
        ended = system.ends[found];
        [t, x] = [t + low, reached(low)];
    }
    function advance(to, deadline = Infinity) {
        while (t < to && !ended) {
            if (Date.now() > deadline) return false;
            const whole = t + 1.01 * h >= to, used = whole ? to - t : h;
            const slope = system.rates(t, x), [after, error] = step(system, t, x, slope, used, rtol, atol);
            if (++steps > MOST_STEPS || !(used > 1e-15 * to)) throw new Error("the steps become too small at t = " + t);
            if (!(error <= 1.0)) {
                h = used * (Number.isFinite(error) ? Math.max(0.2, 0.9 * error ** -0.2) : 0.2);
                continue;
            }
            const found = system.ending(t + used, after);
            if (found >= 0) last(slope, used, found);
            else [t, x] = [whole ? to : t + used, after];
            if (!whole || used >= h) h = used * Math.min(5.0, 0.9 * Math.max(error, 1e-4) ** -0.2);
        }
        return !ended;
    }
    return {
        advance,
        value: (name, q = x.slice(0, system.nq)) => system.asked(name, t, [...q, ...x.slice(system.nq)]),
        get t() { return t; },
        get q() { return x.slice(0, system.nq); },
        get u() { return x.slice(system.nq); },
        get ended() { return ended; },
    };
}

/* The motion until `end`: times t, and q and u at each of `samples` evenly spaced ones; `ended`: why it is over sooner.
   Other options are those of `motion`. */
export function simulate(names, options = {}) {
    const { end = 1.0, samples = 2 } = options, moves = motion(names, { first: 1e-3 * end, ...options });
    const found = { t: [], q: [], u: [], ended: "" };
    for (let sample = 0; sample < samples && !found.ended; sample++) {
        moves.advance((end * sample) / (samples - 1));
        found.t.push(moves.t);
        found.q.push(moves.q);
        found.u.push(moves.u);
        found.ended = moves.ended;
    }
    return found;
}

if (typeof process !== "undefined" && process.argv[1] && import.meta.url.endsWith("/integrate.mjs") &&
    process.argv[1].endsWith("integrate.mjs")) {
    const { existsSync, readFileSync } = await import("node:fs"), table = new URL("names.json", import.meta.url);
    if (!existsSync(table)) {
        console.error("there is no file names.json, which has the start: the export writes it beside this one");
        process.exit(2);
    }
    const names = JSON.parse(readFileSync(table, "utf8"));
    const given = process.argv.slice(2), [end = 1.0, rtol = 1e-9] = given.map(Number);
    [end, rtol].forEach((number, k) => {
        if (number > 0.0 && number < Infinity) return;
        console.error((k ? "the tolerance is a positive number" : "the end of time is a positive number of seconds") + ", not " + given[k]);
        process.exit(2);
    });
    const found = simulate(names, { end, rtol });
    if (found.ended) console.log("stopped at t = " + found.t.at(-1) + " s, where the state of the start ends: " + found.ended);
    const values = [...found.q.at(-1), ...found.u.at(-1)];
    [...names.coordinates, ...names.speeds].forEach((entry, k) =>
        console.log((entry.name + " = " + values[k] + " " + entry.unit).trimEnd()));
}
