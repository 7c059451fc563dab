// The artist's page: a frame, a row for each parameter of the server's table, and nothing that the server does not say.
"use strict";

const $ = id => document.getElementById(id);
const token = new URLSearchParams(location.hash.slice(1)).get("token") || "";
const viewer = "page-" + Math.random().toString(36).slice(2, 10);  // newer requests of ours overtake the older
const state = {
  id: null, session: null, parameters: [], frame: 0, first: 0, last: 0, wipe: 0.5, isPlaying: false,
  isDragging: false, turn: 0, shown: null, plate: null, plateKey: "",
};

// ---- the server ----

async function ask(path, options = {}) {
  const headers = { ...options.headers };
  if (token) headers.Authorization = "Bearer " + token;
  const answer = await fetch(path, { ...options, headers });
  if (answer.ok) return answer;
  let problem = { code: "http", sentence: `the server answered ${answer.status}` };
  try { problem = await answer.json(); } catch { /* no JSON: the status has to do */ }
  throw Object.assign(new Error(problem.sentence), { code: problem.code });
}
const askJson = async (path, options) => (await ask(path, options)).json();

function say(sentence) {
  $("sentence").hidden = !sentence;
  $("sentence").dataset.text = sentence || "";
}
function fail(error) {
  if (error.code === "overtaken" || error.code === "gone") return;
  say(error instanceof TypeError ? "the server does not answer" : error.message);
}

// ---- the picture ----

/** Shows the frame as it is now. Of several calls while one is under way the last one counts. */
async function show() {
  if (!state.id) return;
  const turn = ++state.turn;
  const layer = $("layer").value, scale = state.isDragging ? $("proxy").value : $("scale").value;
  const query = new URLSearchParams({ viewer, colorspace: "sRGB", quality: state.isDragging ? "85" : "95" });
  if (layer !== "beauty") query.set("layers", layer);
  if (scale !== "1") query.set("scale", scale);
  const begun = performance.now();
  try {
    const answer = await ask(`/sessions/${state.id}/frames/${state.frame}?${query}`, { headers: { Accept: "image/jpeg" } });
    const picture = await createImageBitmap(await answer.blob());
    if (turn < state.shown?.turn) return;
    state.shown = { turn, picture, scale: Number(scale), frame: state.frame };
    const render = Number(answer.headers.get("Virga-Render-Ms")), cache = answer.headers.get("Virga-Cache");
    $("timing").value = `${cache === "miss" ? `rendered in ${render.toFixed(0)} ms` : "kept"}, ` +
      `here in ${(performance.now() - begun).toFixed(0)} ms`;
    $("screen").dataset.turn = turn;  // which of the pictures asked for is seen
    $("screen").dataset.wait = (performance.now() - begun).toFixed(1);
    $("screen").dataset.render = render;
    say("");
    await showPlate();
    draw();
  } catch (error) {
    if (turn === state.turn) fail(error);
  }
}

async function showPlate() {
  const key = `${state.id}/${state.frame}`;
  if (!$("wipe").checked || state.plateKey === key) return;
  state.plateKey = key;
  const answer = await ask(`/sessions/${state.id}/plates/${state.frame}?colorspace=sRGB`, { headers: { Accept: "image/jpeg" } });
  state.plate = await createImageBitmap(await answer.blob());
}

function draw() {
  const shown = state.shown;
  $("empty").hidden = !!shown;
  if (!shown) return;
  const plate = state.session.plate, screen = $("screen");
  const fit = Math.min(screen.clientWidth / plate.width, screen.clientHeight / plate.height);
  const zoom = $("fit").checked ? fit : 1 / devicePixelRatio;
  const width = Math.round(plate.width * zoom), height = Math.round(plate.height * zoom);
  const left = Math.max(0, Math.round((screen.clientWidth - width) / 2));
  const top = Math.max(0, Math.round((screen.clientHeight - height) / 2));
  const place = (canvas, picture) => {
    if (canvas.width !== picture.width || canvas.height !== picture.height) {
      canvas.width = picture.width;
      canvas.height = picture.height;
    }
    canvas.getContext("2d").drawImage(picture, 0, 0);
    Object.assign(canvas.style, { left: left + "px", top: top + "px", width: width + "px", height: height + "px" });
  };
  place($("after"), shown.picture);
  const isWiped = $("wipe").checked && state.plate;
  $("before").style.display = isWiped ? "block" : "none";
  $("wiper").style.display = isWiped ? "block" : "none";
  $("after").style.clipPath = isWiped ? `inset(0 0 0 ${100 * state.wipe}%)` : "none";
  if (!isWiped) return;
  place($("before"), state.plate);
  Object.assign($("wiper").style, { left: left + state.wipe * width + "px", top: top + "px", height: height + "px" });
}

// ---- time ----

function goTo(frame) {
  const plate = state.session?.plate;
  if (!plate || Number.isNaN(frame)) return;
  state.frame = plate.is_still ? frame : Math.min(Math.max(frame, plate.first), plate.last);
  $("frame").value = $("time").value = state.frame;
  return show();
}

function setRange(first, last) {
  state.first = Math.min(first, last);
  state.last = Math.max(first, last);
  $("first").value = state.first;
  $("last").value = state.last;
}

/** Plays in time where the frames come soon enough, else each frame as soon as it comes. */
async function play() {
  if (state.isPlaying || !state.session) { state.isPlaying = false; return; }
  state.isPlaying = true;
  $("play").innerHTML = "&#10073;&#10073;";
  const period = 1000 / (state.session.plate.fps || 24);
  while (state.isPlaying) {
    const begun = performance.now();
    await goTo(state.frame >= state.last || state.frame < state.first ? state.first : state.frame + 1);
    const left = period - (performance.now() - begun);
    await new Promise(done => setTimeout(done, Math.max(0, left)));
  }
  $("play").innerHTML = "&#9654;";
}

// ---- parameters ----

let sending = null, unsent = {};
/** One PATCH at a time; what changes meanwhile goes with the next one. */
function change(name, value) {
  unsent[name] = value;
  sending ??= (async () => {
    try {
      while (Object.keys(unsent).length) {
        const values = unsent;
        unsent = {};
        try {
          await ask(`/sessions/${state.id}`, { method: "PATCH", body: JSON.stringify(values), headers: { "Content-Type": "application/json" } });
          Object.assign(state.session.settings, values);
          for (const name in values) rows[name].mark(false);
          show();
        } catch (error) {
          for (const name in values) rows[name].mark(true);
          fail(error);
        }
      }
    } finally { sending = null; }
  })();
}

const rows = {};
const isSame = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

/** Sliders go from least to most; wide ranges by a curve, so that the usual values have room: least is 0 or has a sign
    as well, so the curve is around the default. */
function scaleOf(p) {
  const least = p.least, most = p.most, standard = typeof p.default === "number" ? p.default : 0;
  const isWide = most - least > 50 * Math.max(Math.abs(standard), 1e-3) || most - least > 1e4;
  if (!isWide) return { toValue: t => least + t * (most - least), toPlace: v => (v - least) / (most - least) };
  if (least >= 0) {  // a power: the default at 0.4
    const at = Math.max((Math.abs(standard) || Math.min(most, 1) * 0.1) - least, 1e-6) / (most - least);
    const power = Math.max(1, Math.log(at) / Math.log(0.4));
    return { toValue: t => least + (most - least) * t ** power, toPlace: v => ((v - least) / (most - least)) ** (1 / power) };
  }
  const reach = Math.max(-least, most), power = 3;  // both signs: 0 in the middle
  return {
    toValue: t => Math.min(most, Math.max(least, Math.sign(2 * t - 1) * reach * Math.abs(2 * t - 1) ** power)),
    toPlace: v => 0.5 + 0.5 * Math.sign(v) * (Math.abs(v) / reach) ** (1 / power),
  };
}
const rounded = (value, isWhole) => isWhole ? Math.round(value) : Number(value.toPrecision(3));

/** The controls of one kind: how they are made, read from a value, and what they say. */
const kinds = {
  number(p, say) {
    const isWhole = p.kind === "whole", scale = scaleOf(p);
    const slider = element("input", { type: "range", min: 0, max: 1, step: 0.001 });
    const box = element("input", { type: "number", step: "any", min: p.least, max: p.most });
    if (p.kind === "number-or-auto") { box.type = "text"; box.placeholder = "auto"; box.style.width = "74px"; }
    slider.addEventListener("input", () => {
      box.value = rounded(scale.toValue(Number(slider.value)), isWhole);
      state.isDragging = true;
      say(Number(box.value));
    });
    slider.addEventListener("change", () => { state.isDragging = false; say(Number(box.value)); show(); });
    box.addEventListener("change", () => {
      const value = box.value.trim();
      say(value === "" || Number.isNaN(Number(value)) ? value || "auto" : Number(value));
      slider.value = scale.toPlace(Number(value) || 0);
    });
    return { parts: [slider, box], put: value => {
      box.value = value === "auto" && box.type === "text" ? "" : value;
      slider.value = value === "auto" ? 0 : scale.toPlace(value);
    } };
  },
  pair(p, say) {
    const numbers = [0, 1].map(i => kinds.number({ ...p, kind: "number", default: p.default[i] },
                                                 () => say(numbers.map(n => Number(n.parts[1].value)))));
    const lines = numbers.map(n => element("div", { className: "line" }, ...n.parts));
    return { parts: [element("div", { className: "lines" }, ...lines)], put: value => numbers.forEach((n, i) => n.put(value[i])) };
  },
  color(p, say) {
    const curve = v => Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
    const light = c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
    const auto = element("input", { type: "checkbox" });
    const well = element("input", { type: "color" });
    const tell = () => say(auto.checked ? "auto" : [1, 3, 5].map(i => rounded(light(parseInt(well.value.slice(i, i + 2), 16) / 255))));
    auto.addEventListener("change", tell);
    well.addEventListener("input", () => { auto.checked = false; tell(); });
    return { parts: [element("div", { className: "several" }, well, element("label", {}, auto, " auto"))], put: value => {
      auto.checked = value === "auto";
      if (value !== "auto") well.value = "#" + value.map(v => curve(Math.min(Math.max(v, 0), 1)).toString(16).padStart(2, "0")).join("");
    } };
  },
  switch(p, say) {
    const box = element("input", { type: "checkbox" });
    box.addEventListener("change", () => say(box.checked));
    return { parts: [element("div", { className: "wide" }, box)], put: value => box.checked = value };
  },
  choice(p, say) {
    const list = element("select", { className: "wide" }, ...p.choices.map(word => element("option", { value: word, textContent: word })));
    list.addEventListener("change", () => say(list.value));
    return { parts: [list], put: value => list.value = value };
  },
  text(p, say) {
    const box = element("input", { type: "text", className: "wide", placeholder: "none", spellcheck: false });
    box.addEventListener("change", () => say(box.value));
    return { parts: [box], put: value => box.value = value };
  },
};
kinds.whole = kinds["number-or-auto"] = kinds.number;

function makeRow(p) {
  const row = element("div", { className: "row", title: p.help + (p.least !== undefined ? `\n${p.least} to ${p.most} ${p.unit}` : "") });
  row.dataset.name = p.name;
  const set = value => { change(p.name, value); update(value); };
  const controls = kinds[p.kind](p, set);
  const update = value => { row.classList.toggle("changed", !isSame(value, p.default)); count(p.group); };
  const reset = element("button", { className: "reset", title: `back to ${JSON.stringify(p.default)}`, textContent: "\u21BA" });
  reset.addEventListener("click", () => { controls.put(p.default); set(p.default); });
  const unit = element("small", { textContent: p.unit && p.unit !== "x" ? " " + p.unit : "" });
  row.append(element("label", { textContent: p.name }, unit), ...controls.parts, reset);
  row.firstChild.append(unit);
  for (const part of row.querySelectorAll("input, select")) part.setAttribute("aria-label", p.name);
  rows[p.name] = { row, put: value => { controls.put(value); update(value); }, mark: isWrong => row.classList.toggle("wrong", isWrong) };
  return row;
}

function count(group) {
  const details = document.querySelector(`details[data-group="${group}"]`);
  const changed = details?.querySelectorAll(".row.changed").length;
  if (details) details.querySelector(".count").textContent = changed || "";
}

function makeGroups() {
  for (const group of new Set(state.parameters.map(p => p.group))) {
    const details = element("details", { open: ["rain", "light", "grade"].includes(group) },
      element("summary", { textContent: group }, element("span", { className: "count" })));
    details.dataset.group = group;
    details.firstChild.append(element("span", { className: "count" }));
    for (const p of state.parameters) if (p.group === group) details.append(makeRow(p));
    $("groups").append(details);
  }
}

// ---- sessions ----

async function useSession(id) {
  state.session = await askJson(`/sessions/${id}`);
  state.id = id;
  Object.assign(state, { shown: null, plate: null, plateKey: "" });
  const plate = state.session.plate;
  const still = plate.is_still || plate.first === undefined;
  for (const id of ["time", "frame"]) { $(id).min = plate.first ?? 0; $(id).max = still ? (plate.first ?? 0) + 100 : plate.last; }
  setRange(plate.first ?? 0, still ? (plate.first ?? 0) + 100 : plate.last);
  for (const p of state.parameters) rows[p.name].put(state.session.settings[p.name]);
  document.title = `${plate.path ?? "posted plates"} \u2013 Virga`;
  $("status").textContent = plate.first === undefined ? "no plate yet" :
    `${plate.width} \u00D7 ${plate.height}, ${plate.is_still ? "still" : `${plate.last - plate.first + 1} frames at ${Number(plate.fps.toFixed(3))}`}, ${plate.colorspace}`;
  await goTo(plate.first ?? 0);
}

async function listSessions(chosen) {
  const list = await askJson("/sessions");
  $("sessions").replaceChildren(...list.map(s => element("option", { value: s.id, textContent: s.plate ?? "posted plates" })));
  $("sessions").hidden = list.length === 0;
  if (list.length) { $("sessions").value = chosen ?? list[0].id; await useSession($("sessions").value); }
}

$("open").addEventListener("submit", async event => {
  event.preventDefault();
  try {
    const made = await askJson("/sessions", { method: "POST", body: JSON.stringify({ plate: $("plate").value }), headers: { "Content-Type": "application/json" } });
    await listSessions(made.id);
  } catch (error) { fail(error); }
});
$("sessions").addEventListener("change", () => useSession($("sessions").value).catch(fail));
$("save").addEventListener("click", async () => {
  try {
    const text = await (await ask(`/sessions/${state.id}/settings.toml`)).text();
    const name = (state.session.plate.path ?? "virga").replace(/^.*\//, "").replace(/[^\w-].*$/, "") + ".toml";
    const link = element("a", { href: URL.createObjectURL(new Blob([text])), download: name });
    link.click();
    URL.revokeObjectURL(link.href);
  } catch (error) { fail(error); }
});

// ---- hands ----

$("wiper").addEventListener("pointerdown", event => {
  $("wiper").setPointerCapture(event.pointerId);
  const move = e => {
    const box = $("after").getBoundingClientRect();
    state.wipe = Math.min(1, Math.max(0, (e.clientX - box.left) / box.width));
    draw();
  };
  $("wiper").addEventListener("pointermove", move);
  $("wiper").addEventListener("pointerup", () => $("wiper").removeEventListener("pointermove", move), { once: true });
});
for (const id of ["layer", "scale"]) $(id).addEventListener("change", show);
$("wipe").addEventListener("change", () => showPlate().then(draw).catch(fail));
$("fit").addEventListener("change", draw);
$("time").addEventListener("input", () => goTo(Number($("time").value)));
$("frame").addEventListener("change", () => goTo(Number($("frame").value)));
for (const id of ["first", "last"]) $(id).addEventListener("change", () => setRange(Number($("first").value), Number($("last").value)));
$("play").addEventListener("click", play);
$("back").addEventListener("click", () => goTo(state.frame - 1));
$("on").addEventListener("click", () => goTo(state.frame + 1));
new ResizeObserver(draw).observe($("screen"));
$("search").addEventListener("input", () => {
  const words = $("search").value.toLowerCase().split(/\s+/);
  for (const p of state.parameters) {
    const text = `${p.name} ${p.help}`.toLowerCase();
    rows[p.name].row.hidden = !words.every(word => text.includes(word));
  }
  for (const details of document.querySelectorAll("details")) {
    details.hidden = !details.querySelector(".row:not([hidden])");
    if ($("search").value) details.open = true;
  }
});

const keys = {
  " ": play, ArrowLeft: () => goTo(state.frame - 1), ArrowRight: () => goTo(state.frame + 1),
  Home: () => goTo(state.first), End: () => goTo(state.last),
  i: () => setRange(state.frame, state.last), o: () => setRange(state.first, state.frame),
  w: () => $("wipe").click(), f: () => $("fit").click(), s: () => $("save").click(), "/": () => $("search").focus(),
  ",": () => { state.wipe = Math.max(0, state.wipe - 0.05); draw(); }, ".": () => { state.wipe = Math.min(1, state.wipe + 0.05); draw(); },
};
for (let i = 0; i < 5; ++i) keys[i + 1] = () => { $("layer").selectedIndex = i; show(); };
document.addEventListener("keydown", event => {
  const isTyping = event.target.matches("input:not([type=range]):not([type=checkbox]), select");
  if (isTyping || event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
  if (event.target.matches("[type=range]") && event.key.startsWith("Arrow")) return;
  event.preventDefault();
  keys[event.key]();
});

(async () => {
  try {
    state.parameters = await askJson("/parameters");
    makeGroups();
    await listSessions();
  } catch (error) { fail(error); }
})();
