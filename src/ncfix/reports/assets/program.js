// The page of a program: path, curves and the place that they all show. Data and library are unpacked from the page.
const $ = id => document.getElementById(id);
const chosen = name => document.querySelector(`input[name=${name}]:checked`).value;
const CUT = 0, RAPID = 1, REFUSED = 2, PASSED = 3;
const SCALES = {  // lightness goes one way in each: readable for colour-blind people, and in grey
  false: [[0, "#a9c6e6"], [0.25, "#6f9bd1"], [0.5, "#7a62b8"], [0.75, "#a8286f"], [1, "#5c0620"]],
  true: [[0, "#3a5f95"], [0.25, "#5a8fd6"], [0.5, "#c27fd0"], [0.75, "#ffab66"], [1, "#fff2ae"]],
};
const CONFIG = { displaylogo: false, responsive: true, displayModeBar: false, plotGlPixelRatio: Math.max(devicePixelRatio, 1) };
const FONT = "system-ui, DejaVu Sans, sans-serif";
const COLUMNS = 900;
const number = (value, digits) => value.toFixed(digits).replace("-", "−");

async function unpacked(id) {
  const text = atob($(id).textContent), bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const context = HTMLCanvasElement.prototype.getContext;  // the library reads back what it writes: much faster without a graphics card
HTMLCanvasElement.prototype.getContext = function (kind, more) {
  return context.call(this, kind, kind === "2d" ? { willReadFrequently: true, ...more } : more);
};

async function library() {
  if (window.Plotly || !$("library")) return;
  const script = document.createElement("script");
  script.src = URL.createObjectURL(new Blob([await unpacked("library")], { type: "text/javascript" }));
  await new Promise((done, failed) => {  // compiled beside this thread
    script.addEventListener("load", done);
    script.addEventListener("error", () => failed(new Error("the library cannot be loaded")));
    document.head.append(script);
  });
  URL.revokeObjectURL(script.src);
}

function columns(bytes) {
  const size = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true), found = { };
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + size)));
  const forms = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };
  let at = 4 + size;
  for (const [name, form, count] of head.columns) {
    const Form = forms[form], width = Form.BYTES_PER_ELEMENT;
    found[name] = new Form(bytes.slice(at, at + count * width).buffer);
    at += count * width;
  }
  return { ...head, ...found };
}

class Page {
  constructor(data) {
    this.data = data;
    this.count = data.way.length;
    this.long = this.count && data.way[this.count - 1] > 20000;
    this.way = this.long ? data.way.map(each => each / 1000) : data.way;
    this.unit = this.long ? "m" : "mm";
    let most = 0;
    for (let k = 0; k < this.count; k++) {
      if (data.kind[k] === CUT) most = Math.max(most, data.before[k], data.after[k]);
    }
    this.most = most || 1;
    this.mark = null;
    this.at = this.worst();
    this.boxed();
  }

  boxed() {
    this.box = ["x", "y", "z"].map(name => {
      let low = Infinity, high = -Infinity;
      this.data[name].forEach((each, k) => {
        if (this.data.kind[k] !== RAPID) { low = Math.min(low, each); high = Math.max(high, each); }
      });
      return low <= high ? [low, high] : [0, 1];
    });
    const width = Math.max(...this.box.map(([low, high]) => high - low), 1);
    this.box = this.box.map(([low, high]) => {
      const room = Math.max(0.06 * (high - low), (0.18 * width - (high - low)) / 2);
      return [low - room, high + room];
    });
    const longest = Math.max(...this.box.map(([low, high]) => high - low));
    this.ratio = this.box.map(([low, high]) => (innerWidth < 700 ? 1.2 : 1.7) * (high - low) / longest);
    this.scale = 1;
  }

  // -- the path ---------------------------------------------------------------------------------------------------------

  lines(wanted) {  // polylines of the places that are led to so, with the place before each
    const { x, y, z, kind } = this.data, found = { x: [], y: [], z: [], of: [] };
    let open = false;
    const add = k => { found.x.push(x[k]); found.y.push(y[k]); found.z.push(z[k]); found.of.push(k); };
    for (let k = 0; k < this.count; k++) {
      if (kind[k] !== wanted) { open = false; continue; }
      if (!open) {
        if (found.x.length) { found.x.push(null); found.y.push(null); found.z.push(null); found.of.push(k); }
        if (k) add(k - 1);
        open = true;
      }
      add(k);
    }
    if (wanted === CUT) this.shaped(found);
    return found;
  }

  shaped(found) {  // the place before a cut is shown with the error where the cut begins
    for (let k = 1; k < found.of.length; k++) {
      if (this.data.kind[found.of[k - 1]] !== CUT) found.of[k - 1] = found.of[k];
    }
  }

  colours(of) {
    const side = this.data[chosen("side")], log = chosen("scale") === "log", least = this.least();
    return of.map(k => log ? Math.log10(Math.max(side[k], least)) : side[k]);
  }

  least() { return this.most / 1000; }

  bar() {
    const log = chosen("scale") === "log", ticks = { };
    if (log) {
      const high = Math.log10(this.most), steps = [];
      for (let each = Math.ceil(high - 3); each <= high; each++) steps.push(each);
      steps.push(high);
      Object.assign(ticks, { tickvals: steps, ticktext: steps.map(each => String(+(10 ** each).toPrecision(2))) });
    }
    const title = { text: "tip error, µm", side: innerWidth < 700 ? "top" : "right" };
    const flat = innerWidth < 700 ? { orientation: "h", y: -0.02, yanchor: "top", thickness: 10, len: 0.9 } : { thickness: 12, len: 0.75, x: 1 };
    return { title, ...flat, ...ticks, outlinewidth: 0, tickfont: { color: ink("soft") } };
  }

  traces() {
    const log = chosen("scale") === "log", cut = this.cut ??= this.lines(CUT);
    const hover = of => ({ customdata: of.map(k => [this.data.line[k], this.data.before[k], this.data.after[k]]),
      hovertemplate: "line %{customdata[0]}<br>before %{customdata[1]:.2f} µm, after %{customdata[2]:.2f} µm<extra></extra>" });
    const line = (name, kind, style) => {
      const { x, y, z, of } = this[`path${kind}`] ??= this.lines(kind);
      return { type: "scatter3d", mode: "lines", name, x, y, z, ...hover(of), line: style, showlegend: of.length > 0 };
    };
    return [
      { type: "scatter3d", mode: "lines", name: "corrected", x: cut.x, y: cut.y, z: cut.z, showlegend: false, ...hover(cut.of),
        line: { width: 4, color: this.colours(cut.of), colorscale: SCALES[theme.dark], showscale: true, colorbar: this.bar(),
          cmin: log ? Math.log10(this.least()) : 0, cmax: log ? Math.log10(this.most) : this.most } },
      { ...line("rapid", RAPID, { width: 1.5, color: ink("rapid"), dash: "dot" }), visible: $("rapids").checked },
      line("refused", REFUSED, { width: 5, color: ink("bad") }),
      line("passed by rule", PASSED, { width: 3, color: ink("rapid") }),
      { type: "scatter3d", mode: "markers", name: "place", showlegend: false, hoverinfo: "skip", ...this.marker(),
        marker: { size: 7, color: ink("mark"), symbol: "diamond", line: { color: ink("card"), width: 1 } } },
    ];
  }

  marker() {
    const [x, y, z] = this.mark || [this.data.x[this.at], this.data.y[this.at], this.data.z[this.at]];
    return { x: [x], y: [y], z: [z] };
  }

  scene() {
    const axis = (name, range) => ({ title: { text: name, font: { size: 13, color: ink("ink") } }, tickfont: { size: 11 }, range, backgroundcolor: ink("card"), gridcolor: ink("line"),
      zerolinecolor: ink("rapid"), color: ink("soft"), showspikes: false, nticks: 5 });
    return { xaxis: axis("X", this.box[0]), yaxis: axis("Y", this.box[1]), zaxis: axis("Z", this.box[2]),
      aspectmode: "manual", aspectratio: this.scaled(), dragmode: "orbit", camera: this.camera ??= this.viewed() };
  }

  scaled() {
    const [x, y, z] = this.ratio.map(each => each * this.scale);
    return { x, y, z };
  }

  viewed() {
    const far = 1.9, eyes = { corner: [-1.05, -1.25, 0.95], top: [0, -0.001, far], front: [0, -far, 0.001], side: [far, 0, 0.001] };
    const [x, y, z] = eyes[chosen("from")];
    return { eye: { x, y, z }, center: { x: 0, y: 0, z: -0.05 }, up: { x: 0, y: 0, z: 1 }, projection: { type: "orthographic" } };
  }

  drawn() {
    const legend = { orientation: "h", x: 0, y: 1, bgcolor: "rgba(0,0,0,0)", font: { color: ink("ink") } };
    const layout = { ...this.paper(), margin: { l: 0, r: 0, t: 0, b: innerWidth < 700 ? 40 : 0 }, scene: this.scene(), legend, uirevision: "path" };
    return Plotly.react("view", this.traces(), layout, CONFIG);
  }

  turned(camera) {
    this.camera = camera;
    return Plotly.relayout("view", { "scene.camera": camera, "scene.aspectratio": this.scaled() });
  }

  keys(event) {
    const turns = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12] };
    const zooms = { "+": 1.2, "=": 1.2, "-": 1 / 1.2 };
    const camera = structuredClone($("view").layout.scene.camera), { eye } = camera;
    if (event.key in turns) {
      const [about, up] = turns[event.key], far = Math.hypot(eye.x, eye.y, eye.z);
      const round = Math.atan2(eye.y, eye.x) + about;
      const tilt = Math.max(-1.55, Math.min(1.55, Math.asin(eye.z / far) + up));
      camera.eye = { x: far * Math.cos(tilt) * Math.cos(round), y: far * Math.cos(tilt) * Math.sin(round), z: far * Math.sin(tilt) };
    } else if (event.key in zooms) {
      this.scale *= zooms[event.key];
      for (const name of "xyz") camera.center[name] *= zooms[event.key];
    } else if (event.key === "0") {
      this.whole(camera);
    } else return;
    event.preventDefault();
    this.turned(camera);
  }

  whole(camera = { }) {
    $("near").checked = false;
    this.scale = 1;
    return Object.assign(camera, this.viewed());
  }

  // -- curves -----------------------------------------------------------------------------------------------------------

  paper() {
    return { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: ink("soft"), size: 12, family: FONT },
      hoverlabel: { bgcolor: ink("card"), bordercolor: ink("line"), font: { color: ink("ink") } } };
  }

  flat(x, y, more = { }) {
    const axis = { gridcolor: ink("grid"), zerolinecolor: ink("rapid"), linecolor: ink("line"), automargin: true };
    const legend = { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { color: ink("ink") } };
    return { ...this.paper(), margin: { l: 8, r: 8, t: 8, b: 8 }, xaxis: { ...axis, title: { text: x }, ...more.x },
      yaxis: { ...axis, title: { text: y }, ...more.y }, legend, hovermode: more.hovermode || "x" };
  }

  stretches(low, high, value) {  // for each of at most COLUMNS stretches of the way, the place with the largest value
    const first = this.place(low), last = Math.min(this.place(high) + 1, this.count - 1), found = [];
    const width = Math.max((last - first + 1) / COLUMNS, 1);
    for (let from = first; from <= last; from += width) {
      let best = -1;
      for (let k = Math.floor(from); k < Math.min(Math.floor(from + width), last + 1); k++) {
        if (this.data.kind[k] !== RAPID && (best < 0 || value(k) > value(best))) best = k;
      }
      if (best >= 0) found.push(best);
    }
    return found;
  }

  place(way) {  // the last place up to there
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.way[middle] <= way) low = middle; else high = middle - 1;
    }
    return low;
  }

  ends() {  // where the first cut begins and the last one ends
    const cuts = k => this.data.kind[k] !== RAPID;
    let first = 0, last = this.count - 1;
    while (first < last && !cuts(first)) first++;
    while (last > first && !cuts(last)) last--;
    return [this.way[Math.max(first - 1, 0)], this.way[last]];
  }

  along(range = this.ends()) {
    this.range = range;
    const trace = side => {
      const of = this.stretches(...range, k => this.data[side][k]);
      return { type: "scatter", mode: "lines", name: side, x: of.map(k => this.way[k]), y: of.map(k => this.data[side][k]),
        customdata: of.map(k => this.data.line[k]), line: { color: ink(side), width: side === "after" ? 1.8 : 1.4 },
        fill: $("log").checked || side === "after" ? "none" : "tozeroy", fillcolor: ink(side) + "22",
        hovertemplate: `${side} %{y:.2f} µm, line %{customdata}<extra></extra>` };
    };
    const y = $("log").checked ? { type: "log", dtick: 1 } : { rangemode: "tozero" };
    const layout = this.flat(`length of path, ${this.unit}`, "tip error, µm", { y, x: { range } });
    layout.shapes = [this.cursor()];
    return Plotly.react("along", [trace("before"), trace("after")], layout, CONFIG);
  }

  cursor() {
    const x = this.markWay ?? this.way[this.at];
    return { type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line: { color: ink("mark"), width: 1.5 } };
  }

  spread() {
    const { edges, share } = this.data, trace = side => ({
      type: "scatter", mode: "lines", name: side, line: { shape: "hv", color: ink(side), width: 1.8 }, fill: "tozeroy",
      fillcolor: ink(side) + "33", x: edges, y: [...share[side], 0], hovertemplate: `${side}: %{y:.1f} % of the path<extra></extra>` });
    const filled = edges.map((_, k) => k).filter(k => share.before[k] || share.after[k]);
    const range = filled.length ? [edges[Math.max(filled[0] - 1, 0)], edges[Math.min(filled.at(-1) + 2, edges.length - 1)]].map(Math.log10) : undefined;
    const x = { type: "log", dtick: 1, exponentformat: "none", range };
    return Plotly.react("spread", [trace("before"), trace("after")], this.flat("tip error, µm", "share of the path, %", { x, y: { rangemode: "tozero" } }), CONFIG);
  }

  corrections(id, turning, title) {
    const changed = axis => this.data[`shift_${axis.name}`].some(each => each);
    const axes = this.data.axes.filter(each => each.rotary === turning && changed(each));
    $(id).hidden = !axes.length;
    if (!axes.length) return null;
    const dashes = ["solid", "dash", "dot", "dashdot"];
    const tints = [ink("after"), ink("before"), ink("good"), ink("mark")];
    const traces = axes.map((axis, n) => {
      const column = this.data[`shift_${axis.name}`], of = this.stretches(0, Infinity, k => Math.abs(column[k]));
      return { type: "scatter", mode: "lines", name: axis.name, x: of.map(k => this.way[k]), y: of.map(k => column[k]),
        line: { color: tints[n % 4], dash: dashes[n % 4], width: 1.5 }, hovertemplate: `${axis.name} %{y:.2f} ${axis.unit}<extra></extra>` };
    });
    return Plotly.react(id, traces, this.flat(`length of path, ${this.unit}`, title, { x: { range: this.ends() } }), CONFIG);
  }

  curves() {
    return { along: () => this.along(this.range), spread: () => this.spread(),
      linear: () => this.corrections("linear", false, "correction, µm"), rotary: () => this.corrections("rotary", true, "correction, mdeg") };
  }

  unroll() {  // a curve is drawn when it comes near the window, and all are for the printer
    const waiting = new Map(Object.entries(this.curves()));
    const draw = id => { waiting.get(id)?.(); waiting.delete(id); };
    const near = new IntersectionObserver(seen => seen.filter(each => each.isIntersecting).forEach(each => draw(each.target.id)), { rootMargin: "300px" });
    ["spread", "linear", "rotary"].forEach(id => near.observe($(id)));
    addEventListener("beforeprint", () => [...waiting.keys()].forEach(draw));
    theme.changed(() => { this.drawn(); for (const [id, each] of Object.entries(this.curves())) if (!waiting.has(id)) each(); });
    return draw("along");
  }

  // -- the place --------------------------------------------------------------------------------------------------------

  show(at, spot = null) {
    this.at = Math.max(0, Math.min(this.count - 1, at));
    this.mark = spot && [spot.x, spot.y, spot.z];
    this.markWay = spot && spot.way / (this.long ? 1000 : 1);
    this.told(spot);
    if (this.waiting === undefined) this.waiting = requestAnimationFrame(() => this.marked());
  }

  told(spot = null) {  // what there is to say of the place
    $("at").value = this.at;
    const data = this.data, { x: [x], y: [y], z: [z] } = this.marker();
    const line = spot ? spot.line : data.line[this.at];
    const errors = spot ? [spot.before, spot.after] : [data.before[this.at], data.after[this.at]];
    const rows = [["line", line], ["length of path", `${number(this.markWay ?? this.way[this.at], this.long ? 4 : 2)} ${this.unit}`],
      ["X Y Z, mm", [x, y, z].map(each => number(each, 3)).join(" ")],
      ["error before", `${number(errors[0], 2)} µm`], ["error after", `${number(errors[1], 2)} µm`],
      ...data.axes.map(axis => [`correction ${axis.name}`, `${number(data[`shift_${axis.name}`][this.at], 2)} ${axis.unit}`])];
    const list = document.createElement("dl");
    for (const [name, value] of rows) {
      const [term, said] = ["dt", "dd"].map(tag => document.createElement(tag));
      term.textContent = name; said.textContent = value;
      list.append(term, said);
    }
    $("here").replaceChildren(list, this.source(line));
    $("at").setAttribute("aria-valuetext", `line ${line}, error before ${number(errors[0], 2)} µm`);
    for (const row of document.querySelectorAll("tr[aria-current]")) row.removeAttribute("aria-current");
  }

  marked() {  // once a frame, however fast the slider moves
    this.waiting = undefined;
    const { x, y, z } = this.marker();
    Plotly.restyle("view", { x: [x], y: [y], z: [z] }, [4]);
    Plotly.relayout("along", { shapes: [this.cursor()] });
    if ($("near").checked) this.zoomed();
  }

  zoomed() {
    const tip = this.marker(), camera = structuredClone($("view").layout.scene.camera);
    this.scale = Math.max(this.scale, 6);
    ["x", "y", "z"].forEach((name, k) => {
      const [low, high] = this.box[k];
      camera.center[name] = this.scale * this.ratio[k] * ((tip[name][0] - low) / (high - low) - 0.5);
    });
    this.turned(camera);
  }

  source(line) {
    const block = document.createElement("pre");
    for (let k = line - 2; k <= line + 2; k++) {
      const text = this.data.source[k];
      if (text === undefined) continue;
      const part = document.createElement(k === line ? "span" : "i");
      part.className = k === line ? "here" : "";
      part.style.fontStyle = "normal";
      part.textContent = `${String(k).padStart(5)}  ${text}${k === line ? "" : "\n"}`;
      block.append(part);
    }
    block.hidden = !block.childNodes.length;
    block.tabIndex = 0;
    return block;
  }

  worst() {
    let best = 0;
    const side = this.data[chosen("side")];
    for (let k = 0; k < this.count; k++) {
      if (this.data.kind[k] === CUT && (this.data.kind[best] !== CUT || side[k] > side[best])) best = k;
    }
    return best;
  }

  listen() {
    const redraw = () => this.drawn();
    for (const name of ["side", "scale"]) document.querySelectorAll(`input[name=${name}]`).forEach(each => each.addEventListener("change", redraw));
    document.querySelectorAll("input[name=from]").forEach(each => each.addEventListener("change", () => this.turned(this.whole())));
    $("rapids").addEventListener("change", redraw);
    $("near").addEventListener("change", () => $("near").checked ? this.zoomed() : this.turned(this.whole()));
    $("log").addEventListener("change", () => this.along(this.range));
    $("at").addEventListener("input", () => this.show(+$("at").value));
    $("prev").addEventListener("click", () => this.show(this.at - 1));
    $("next").addEventListener("click", () => this.show(this.at + 1));
    $("worst").addEventListener("click", () => this.show(this.worst()));
    $("view").addEventListener("keydown", event => this.keys(event));
    $("view").on("plotly_click", ({ points: [{ x, y, z, customdata }] }) => this.show(this.nearest(x, y, z, customdata?.[0])));
    $("view").on("plotly_relayout", change => {
      this.camera = change["scene.camera"] || this.camera;
      if (change["scene.aspectratio"]) this.scale = change["scene.aspectratio"].x / this.ratio[0];
    });
    $("along").on("plotly_click", ({ points: [{ x }] }) => this.show(this.place(x)));
    $("along").on("plotly_relayout", change => {
      const low = change["xaxis.range[0]"], high = change["xaxis.range[1]"];
      if (low !== undefined) this.along([+low, +high]);
      else if (change["xaxis.autorange"]) this.along();
    });
    for (const button of document.querySelectorAll("button[data-spot]")) {
      button.addEventListener("click", () => {
        const spot = this.data.spots[button.dataset.spot];
        this.show(this.place(spot.way / (this.long ? 1000 : 1)), spot);
        button.closest("tr").setAttribute("aria-current", "true");
        const top = $("view").getBoundingClientRect();
        if (top.bottom < 80 || top.top > innerHeight - 80) $("h-path").scrollIntoView();
      });
    }
  }

  nearest(x, y, z, line) {
    let best = 0, least = Infinity;
    for (let k = 0; k < this.count; k++) {
      const far = Math.abs(this.data.x[k] - x) + Math.abs(this.data.y[k] - y) + Math.abs(this.data.z[k] - z);
      if (far + (this.data.line[k] === line ? 0 : 1e-6) < least) { least = far + (this.data.line[k] === line ? 0 : 1e-6); best = k; }
    }
    return best;
  }
}

async function begin() {
  const drawing = library(), data = columns(await unpacked("data"));
  drawing.catch(() => { });  // told below
  if (!data.way.length) {
    $("trouble").textContent = "There is nothing to draw: no motion of this program was corrected.";
    $("trouble").hidden = false;
    return;
  }
  const page = new Page(data);
  $("at").max = page.count - 1;
  page.told();
  await drawing;
  await page.unroll();
  await new Promise(shown => setTimeout(shown));  // the curve is seen before the path is drawn
  await page.drawn();
  page.listen();
}
begin().then(() => { document.documentElement.dataset.ready = "yes"; document.documentElement.dataset.readyMs = Math.round(performance.now()); }, error => {
  $("trouble").textContent = `The pictures cannot be drawn: ${error.message}. A browser of 2023 or later with WebGL is needed.`;
  $("trouble").hidden = false;
  document.documentElement.dataset.ready = "no";
  console.error(error);
});
