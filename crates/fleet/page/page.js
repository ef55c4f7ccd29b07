// The live page. State comes once from /api/state, then what changes from /api/events. Nothing is asked of another host.
"use strict";

const SPARK_POINTS = 60; // a minute, a point a second
const SILENCE_MS = 7000; // the server says something every 5 s
const PLOT_EVERY_MS = 1000;

const gateways = new Map(); // name -> { data, sensors: Map(slot -> sensor), element }
let allowsWrites = false;
let chosen = null; // { gateway, slot }
let heardAt = 0;
let isPaused = false;
let plotly = null;
const dirty = new Set(); // sensors to be drawn in the next frame

const $ = (id) => document.getElementById(id);

function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  return element;
}

function degrees(mdeg) {
  return (mdeg / 1000).toFixed(3) + "°";
}

function age(ms) {
  if (ms === null || ms === undefined) return "never";
  if (ms < 10000) return ms + " ms ago";
  if (ms < 600000) return Math.floor(ms / 1000) + " s ago";
  if (ms < 36000000) return Math.floor(ms / 60000) + " min ago";
  return Math.floor(ms / 3600000) + " h ago";
}

function label(sensor) {
  return sensor.name || sensor.bus.toUpperCase() + (sensor.address ? " " + sensor.address : "");
}

function marks(sensor) {
  return sensor.alarms.map((alarm) => "alarm " + alarm.name + (alarm.state === "active" ? "" : " (" + alarm.state + ")"))
    .concat(sensor.health);
}

function gatewayOf(name) {
  let gateway = gateways.get(name);
  if (!gateway) {
    const element = make("section");
    const id = "gateway-" + gateways.size;
    element.setAttribute("aria-labelledby", id);
    const head = make("div", "gateway-head");
    const title = make("h2", "", name);
    title.id = id;
    const state = make("p");
    const actions = make("p");
    head.append(title, state, actions);
    const list = make("ul", "sensors");
    element.append(head, list);
    $("gateways").append(element);
    gateway = { name, data: {}, sensors: new Map(), state, actions, list };
    gateways.set(name, gateway);
  }
  return gateway;
}

function drawGateway(gateway) {
  const data = gateway.data;
  gateway.state.className = data.gone ? "gone" : "faint";
  const stats = (data.buses || []).filter((bus) => bus.kind === "stats").map((bus) =>
    bus.bus.toUpperCase() + " bus: " + bus.values.good + " of " + bus.values.requests + " answered");
  const start = data.start ? "start " + data.start.boot + " (" + (data.start.cause || "cause unknown") + "), firmware " + data.start.version : "";
  gateway.state.textContent = data.gone ? "gone: " + data.gone : [start, ...stats, ...(data.signals || [])].filter(Boolean).join(" · ");
  if (allowsWrites && !gateway.actions.hasChildNodes()) {
    gateway.actions.append(action("Scan T7 bus", gateway.name, "scan"), " ", action("Acknowledge alarms", gateway.name, "acknowledge"));
  }
}

function action(text, gateway, command, slot) {
  const button = make("button", "", text);
  button.type = "button";
  button.addEventListener("click", () => ask(text + (slot === undefined ? " of " + gateway : "") + "?", () => run(gateway, command, slot)));
  return button;
}

function ask(text, then) {
  $("ask-text").textContent = text;
  const dialog = $("ask");
  dialog.returnValue = "no";
  dialog.addEventListener("close", () => { if (dialog.returnValue === "yes") then(); }, { once: true });
  dialog.showModal();
}

async function run(gateway, command, slot) {
  const note = $("note");
  note.textContent = command + ": under way";
  try {
    const answer = await fetch("/api/command", {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ gateway, command, slot }),
    });
    const text = await answer.text();
    note.textContent = command + ": " + (answer.ok ? summary(JSON.parse(text).answer) : text);
  } catch (why) {
    note.textContent = command + ": " + why.message;
  }
}

function summary(objects) {
  return objects.filter((object) => !object.progress).map((object) => JSON.stringify(object).replace(/["{}]/g, " ").trim()).join("; ");
}

function sensorOf(gateway, data) {
  let sensor = gateway.sensors.get(data.slot);
  if (!sensor) {
    const item = make("li");
    const card = make("button", "sensor");
    card.type = "button";
    const head = make("span", "sensor-head");
    const name = make("span");
    const ageText = make("span", "faint");
    head.append(name, ageText);
    const angle = make("span", "angle");
    const status = make("span", "marks");
    const spark = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    spark.setAttribute("class", "spark");
    spark.setAttribute("viewBox", "0 0 59 30");
    spark.setAttribute("preserveAspectRatio", "none");
    spark.setAttribute("aria-hidden", "true");
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
    spark.append(path);
    card.append(head, angle, status, spark);
    card.addEventListener("click", () => choose(gateway.name, data.slot));
    item.append(card);
    // In the order of the slots.
    const next = [...gateway.sensors.values()].filter((other) => other.data.slot > data.slot).sort((a, b) => a.data.slot - b.data.slot)[0];
    gateway.list.insertBefore(item, next ? next.item : null);
    sensor = { data, item, card, name, ageText, angle, status, path, minute: data.minute || [], at: performance.now(), pending: [] };
    gateway.sensors.set(data.slot, sensor);
  }
  return sensor;
}

function take(gateway, data) {
  const sensor = sensorOf(gateway, data);
  sensor.data = data;
  sensor.at = performance.now();
  if (data.minute) sensor.minute = data.minute.slice(-SPARK_POINTS);
  sensor.latest = data.angle_mdeg;
  dirty.add(sensor);
}

// The angles of a small plot: a jump from one end of the range to the other breaks the line.
function spark(points) {
  const known = points.filter((point) => point !== null);
  if (known.length === 0) return "";
  let low = Math.min(...known);
  let high = Math.max(...known);
  if (high - low < 200) { const middle = (high + low) / 2; low = middle - 100; high = middle + 100; }
  let path = "";
  let last = null;
  const offset = SPARK_POINTS - points.length;
  points.forEach((point, index) => {
    if (point !== null) {
      const breaks = last === null || Math.abs(point - last) > 180000;
      path += (breaks ? "M" : "L") + (offset + index) + " " + (28 - 26 * (point - low) / (high - low)).toFixed(1);
      if (breaks) path += "h.01";
    }
    last = point;
  });
  return path;
}

function drawSensor(sensor) {
  const data = sensor.data;
  const list = marks(data);
  const isOk = data.status === "ok" && data.angle_mdeg !== null;
  sensor.card.className = "sensor" + (isOk ? "" : " bad") + (data.alarms.length ? " alarm" : "");
  sensor.name.textContent = label(data);
  sensor.angle.className = isOk ? "angle" : "none";
  sensor.angle.textContent = isOk ? degrees(data.angle_mdeg) : "no value: " + data.status.replaceAll("_", " ");
  sensor.status.textContent = list.length ? " " + list.join(", ") : "";
  drawAge(sensor);
  sensor.path.setAttribute("d", spark(sensor.minute));
}

function drawAge(sensor) {
  const data = sensor.data;
  const grown = data.age_ms === null ? null : data.age_ms + Math.round(performance.now() - sensor.at);
  sensor.ageText.textContent = age(grown);
}

function frame() {
  for (const sensor of dirty) drawSensor(sensor);
  dirty.clear();
  drawDetail();
}

// Once a second: ages, the next point of every small plot, and whether the server still speaks.
function second() {
  for (const gateway of gateways.values()) {
    for (const sensor of gateway.sensors.values()) {
      sensor.minute.push(sensor.data.status === "ok" ? sensor.data.angle_mdeg : null);
      if (sensor.minute.length > SPARK_POINTS) sensor.minute.shift();
      dirty.add(sensor);
    }
  }
  if (heardAt && performance.now() - heardAt > SILENCE_MS) lost();
  requestAnimationFrame(frame);
}

function lost() {
  $("connection").textContent = "no connection to the server: no values";
  $("connection").className = "gone";
  for (const gateway of gateways.values()) {
    gateway.data.gone = "no connection to the server";
    drawGateway(gateway);
    for (const sensor of gateway.sensors.values()) {
      if (sensor.data.status !== "no_connection") {
        sensor.data = { ...sensor.data, status: "no_connection", angle_mdeg: null };
        dirty.add(sensor);
      }
    }
  }
  requestAnimationFrame(frame);
}

function apply(state) {
  for (const data of state.gateways) {
    const gateway = gatewayOf(data.name);
    if ("gone" in data) { gateway.data = data; drawGateway(gateway); }
    for (const sensor of data.sensors || []) take(gateway, sensor);
    for (const slot of data.removed || []) {
      const sensor = gateway.sensors.get(slot);
      if (sensor) { sensor.item.remove(); gateway.sensors.delete(slot); }
    }
  }
  requestAnimationFrame(frame);
}

async function readAll() {
  const answer = await fetch("/api/state");
  if (!answer.ok) throw new Error("state: " + answer.status);
  const state = await answer.json();
  allowsWrites = state.allows_writes;
  for (const gateway of gateways.values()) {
    const now = state.gateways.find((other) => other.name === gateway.name);
    for (const [slot, sensor] of gateway.sensors) {
      if (!now || !now.sensors.some((other) => other.slot === slot)) { sensor.item.remove(); gateway.sensors.delete(slot); }
    }
  }
  heard();
  apply(state);
}

function heard() {
  heardAt = performance.now();
  $("connection").textContent = "live";
  $("connection").className = "";
}

function listen() {
  const events = new EventSource("/api/events");
  events.onopen = () => readAll().catch(lost);
  events.onmessage = (event) => { heard(); apply(JSON.parse(event.data)); };
  events.addEventListener("again", () => readAll().catch(lost));
  events.onerror = lost;
}

function chosenSensor() {
  return chosen && gateways.get(chosen.gateway)?.sensors.get(chosen.slot);
}

function choose(gateway, slot) {
  chosen = { gateway, slot };
  $("detail").hidden = false;
  $("detail-actions").replaceChildren();
  if (allowsWrites) {
    $("detail-actions").append(action("Set soft zero of slot " + slot, gateway, "zero", slot), " ", action("Acknowledge slot " + slot, gateway, "acknowledge", slot));
  }
  drawDetail();
  drawPlot(true);
  $("close").focus();
  $("detail").scrollIntoView({ block: "nearest" });
}

function close() {
  const sensor = chosenSensor();
  chosen = null;
  $("detail").hidden = true;
  if (sensor) sensor.card.focus();
}

function drawDetail() {
  const sensor = chosenSensor();
  if (!sensor) return;
  const data = sensor.data;
  const isOk = data.status === "ok" && data.angle_mdeg !== null;
  $("detail-title").textContent = label(data) + ", " + chosen.gateway + ", slot " + data.slot;
  $("detail-angle").textContent = isOk ? degrees(data.angle_mdeg) : "no value";
  $("detail-angle").className = isOk ? "angle" : "none";
  $("detail-status").textContent = [data.status.replaceAll("_", " "), ...marks(data)].join(", ");
  $("detail-facts").textContent = data.kind.toUpperCase() + ", bus " + data.bus + (data.address ? ", address " + data.address : "") + ", measured " + sensor.ageText.textContent;
  // A picture's y axis points down: an angle that grows turns the line against the clock.
  $("needle").setAttribute("transform", "rotate(" + (isOk ? -data.angle_mdeg / 1000 : 0) + ")");
  $("needle").setAttribute("class", isOk ? "needle" : "needle absent");
  $("tilt-title").textContent = isOk ? "tilt " + degrees(data.angle_mdeg) : "no value";
  $("csv").href = "/api/csv?" + query();
}

function query() {
  return new URLSearchParams({ gateway: chosen.gateway, slot: chosen.slot, span_s: $("span").value });
}

function loadPlotly() {
  if (!plotly) {
    plotly = new Promise((resolve, reject) => {
      const script = make("script");
      script.src = "/plotly.js";
      script.onload = () => resolve(window.Plotly);
      script.onerror = () => reject(new Error("plotly.js does not load"));
      document.head.append(script);
    });
  }
  return plotly;
}

let plotBusy = false;
async function drawPlot(isNew) {
  if (!chosen || plotBusy || (isPaused && !isNew)) return;
  plotBusy = true;
  const wanted = query().toString();
  try {
    const [library, answer] = await Promise.all([loadPlotly(), fetch("/api/history?" + wanted)]);
    if (!answer.ok) {
      library.purge($("plot"));
      $("plot").textContent = "no value yet";
      return;
    }
    const span = await answer.json();
    if ($("plot").textContent === "no value yet") $("plot").textContent = "";
    const end = span.from + span.lowest.length * span.interval_ms;
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(name).trim();
    const x = span.lowest.map((_, index) => new Date(span.from + index * span.interval_ms));
    const line = { color: colour("--mark"), width: 1.5, shape: "linear" };
    const traces = [
      { x, y: span.lowest, mode: "lines", line, name: "lowest", connectgaps: false, hovertemplate: "%{y:.3f}°<extra>lowest</extra>" },
      { x, y: span.highest, mode: "lines", line, name: "highest", connectgaps: false, fill: "tonexty", hovertemplate: "%{y:.3f}°<extra>highest</extra>" },
    ];
    const layout = {
      margin: { l: 64, r: 12, t: 12, b: 40 }, showlegend: false, uirevision: wanted,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: colour("--text") },
      xaxis: { gridcolor: colour("--line"), range: [new Date(end - 1000 * $("span").value), new Date(end)] },
      yaxis: { gridcolor: colour("--line"), ticksuffix: "°", fixedrange: false },
    };
    await library.react($("plot"), traces, layout, { responsive: true, displaylogo: false, scrollZoom: true });
    $("plot").setAttribute("aria-label", "plot of the angle, " + $("span").selectedOptions[0].textContent);
  } catch (why) {
    $("note").textContent = why.message;
  } finally {
    plotBusy = false;
  }
}

$("close").addEventListener("click", close);
$("span").addEventListener("change", () => { drawDetail(); drawPlot(true); });
$("pause").addEventListener("click", () => {
  isPaused = !isPaused;
  $("pause").setAttribute("aria-pressed", String(isPaused));
  $("pause").textContent = isPaused ? "Go on" : "Pause";
});
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && chosen && !$("ask").open) close(); });
setInterval(second, 1000);
setInterval(() => drawPlot(false), PLOT_EVERY_MS);
listen();
