// A page without a browser: elements that remember what is written on them, for the script of a live page in node.
const heard = [];
function element(tag) {
  const found = {}, self = {
    tag, dataset: {}, style: {}, attributes: {}, value: "1", textContent: "", clientWidth: 100, clientHeight: 50,
    classList: { add() {}, remove() {} },
    setAttribute(name, value) { this.attributes[name] = value; },
    getAttribute(name) { return this.attributes[name] ?? null; },
    append() {}, add() {}, removeEventListener() {},
    addEventListener(name, does) { heard.push({ element: this, name, does }); },
    getContext: () => new Proxy({}, { get: () => () => {}, set: () => true }),
    querySelector: (selector) => found[selector] || (found[selector] = element(selector)),
    querySelectorAll: (selector) => (selector === ".plots figure" ? [element("figure"), element("figure")] : []),
    get valueAsNumber() { return Number(this.value); },
  };
  return self;
}
Object.assign(globalThis, {
  document: { createElement: element, querySelector: () => null, addEventListener() {}, activeElement: null },
  window: { devicePixelRatio: 1, addEventListener() {}, matchMedia: () => ({ addEventListener() {} }) },
  getComputedStyle: () => ({ color: "black" }), Option: function () {}, requestAnimationFrame() {},
  location: { hash: "", pathname: "/", search: "" }, history: { replaceState(a, b, to) { globalThis.address = to; } },
});
const root = element("section");
root.querySelector(".live-data").textContent = JSON.stringify(data);
live(root, () => ({ switches: {}, show() {}, reset() {}, recolour() {} }));

// Type a number into the field of a name; press a key.
function typed(name, value) {
  const field = heard.find((each) => each.name === "input" && each.element.attributes["aria-label"] === name && each.element.type === "number");
  field.element.value = String(value);
  field.does();
}
function pressed(key) {
  const event = { key, target: { matches: () => false }, preventDefault() {} };
  for (const each of heard) if (each.name === "keydown") each.does(event);
}
