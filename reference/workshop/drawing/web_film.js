// The player of a film: draws `film`, which web_film.py made, on a canvas for each floor.
// k  frame;  t  seconds;  i  a body: people, then robots;  one  a body in a frame

const STATES = ["follower", "leader", "out", "died here", "robot"]
const [FOLLOWER, LEADER, OUT, DEAD, ROBOT] = STATES.keys()
const DONE = -2 // what a robot says whose work is done
const [across, down] = film.size, root = document.documentElement
const all = (what, within = document) => [...within.querySelectorAll(what)]
const [button, slider, told, speed] = all("footer button, footer input, output, select")
const range = n => [...Array(n).keys()]
const small = matchMedia("(max-width: 699px), (max-height: 499px)") // one run at a time
const taps = matchMedia("(pointer: coarse)")

// -- The data -----------------------------------------------------------------------

async function unpack([length, text]) { // sums of steps, `length` numbers a row
  const bytes = Uint8Array.from(atob(text), sign => sign.charCodeAt(0))
  const whole = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))
  const numbers = new Int16Array(await new Response(whole).arrayBuffer())
  for (let k = 0; k < numbers.length; k++) if (k % length) numbers[k] += numbers[k - 1]
  return range(length ? numbers.length / length : 0).map(r => numbers.subarray(r * length, (r + 1) * length))
}
async function read(run, which) {
  const rows = await unpack(run.bodies), names = film.columns, cells = await unpack(run.flames)
  run.frames = range(run.bodies[0]).map(k => range(rows.length / names.length).map(i =>
    Object.fromEntries([["i", i], ...names.map((n, c) => [n, rows[i * names.length + c][k]])])))
  run.flames = range(run.flames[0]).map(j => cells.map(row => row[j]))
  run.counts = run.frames.map(bodies => STATES.map((_, state) =>
    bodies.filter(one => one.state == state).length))
  Object.assign(run, { article: all("article")[which], chosen: -1 })
}
const { begin, end } = film, part = t => (t - begin) / (end - begin || 1) // from 0 to 1
const when = k => Math.min(begin + k * film.step, end) // s; the last frame is the end
const frame = (run, t) => t >= end - 1e-6 ? run.frames.length - 1 :
  Math.min(Math.floor((t - begin) / film.step + 1e-6), run.frames.length - 1)
const since = (run, i, state) => // s when a body got into a state, before the film: never
  when(run.frames.findIndex(bodies => bodies[i].state == state))
function bodies(run, t) { // where and how all are, also between two frames
  const k = frame(run, t), next = run.frames[k + 1] ?? run.frames[k]
  const passed = (t - when(k)) / (when(k + 1) - when(k) || 1) // 0 to 1, of the interval
  return run.frames[k].map((one, i) => {
    const [dx, dy] = [next[i].x - one.x, next[i].y - one.y], walks = Math.hypot(dx, dy) < 40
    const part = walks && next[i].floor == one.floor ? passed : 0
    return { ...one, x: one.x + part * dx, y: one.y + part * dy }
  })
}

// -- Shapes, in a square from -1 to 1 -----------------------------------------------

// outline, colours of its inside and of its edge, widths of the edge and of a halo
const SHAPES = {
  follower: ["M1 0A1 1 0 1 1-1 0A1 1 0 1 1 1 0Z", "", "ink", 1],
  leader: ["M0-1.3L1.2.9H-1.2Z", "", "ink", 1],
  "died here": ["M-1-1L1 1M1-1L-1 1", "", "ink", 1.8],
  robot: ["M0-1.4L1.4 0L0 1.4L-1.4 0Z", "robot", "ink", 2.2],
  destination: ["M-1 0H1M0-1V1", "", "ink", 1.4, 3.2],
  "fire source": ["M0-1.8L.5-.6L1.8-.5L.8.3L1.1 1.6L0 .9L-1.1 1.6L-.8.3L-1.8-.5L-.5-.6Z",
    "source", "page", 1],
  flames: ["M-1-1H1V1H-1Z", "flame", "ember", 0.6],
  ash: ["M-1-1H1V1H-1Z", "ash", "ash", 0.6],
  "burnt door": ["M-1-1H1V1H-1Z", "char", "flame", 1],
  ring: ["M2 0A2 2 0 1 1-2 0A2 2 0 1 1 2 0Z", "", "source", 2],
}
for (const shape of Object.values(SHAPES)) shape[0] = new Path2D(shape[0])
let inks = {}, density = 1, metre = 8, size = 4 // of marks; all in pixels
const ink = name => inks[name] ??= getComputedStyle(root).getPropertyValue("--" + name)
function put(context, name, x, y, size, colour) {
  const [outline, fill, edge, width, halo] = SHAPES[name]
  context.save()
  context.translate(x, y)
  context.scale(size, size)
  Object.assign(context, { strokeStyle: ink(edge), lineWidth: width / size })
  context.fillStyle = colour || ink(fill)
  if (colour || fill) context.fill(outline)
  if (halo) {
    Object.assign(context, { strokeStyle: ink("floor"), lineWidth: halo / size })
    context.stroke(outline)
    Object.assign(context, { strokeStyle: ink(edge), lineWidth: width / size })
  }
  context.stroke(outline)
  context.restore()
}
const colour = health => film.health[Math.ceil(health / 100 * film.health.length) - 1]
const steps = film.health.map((ink, k, { length }) => // of the scale
  `${ink} ${100 * k / length}% ${100 * (k + 1) / length}%`)
function line(context, way, colour, width) {
  context.beginPath()
  way.forEach(({ x, y }) => context.lineTo(x * metre / 10, y * metre / 10))
  Object.assign(context, { strokeStyle: ink(colour), lineWidth: width })
  context.stroke()
}

const isStairwell = ([, , , , , name]) => /^[A-D]$/.test(name)
function write(context, [, x, y, decimetres, upright, name]) { // not huge
  context.save()
  context.translate(x * metre / 10, y * metre / 10)
  if (upright) context.rotate(-Math.PI / 2)
  Object.assign(context, { font: `${Math.min(decimetres * metre / 10, 15)}px system-ui`,
    textAlign: "center", textBaseline: "middle", lineJoin: "round", lineWidth: 3,
    strokeStyle: ink("floor"), fillStyle: ink("text") })
  context.strokeText(name, 0, 0)
  context.fillText(name, 0, 0)
  context.restore()
}

function together(bodies) { // robots on one spot, of which one is seen, and how many
  const robots = bodies.filter(one => one.state == ROBOT)
  const near = one => robots.filter(two => Math.hypot(two.x - one.x, two.y - one.y) < film.spot)
  return robots.map(one => [one, near(one)])
    .filter(([one, all]) => all.length > 1 && all[0] == one).map(([one, all]) => [one, all.length])
}

// -- A floor at an instant ----------------------------------------------------------

function paint(run, floor, canvas, bodies, t) {
  const context = canvas.getContext("2d"), k = frame(run, t), dm = metre / 10
  const at = (name, x, y, colour) => put(context, name, x * dm, y * dm, size, colour)
  const cell = (name, row, column) =>
    put(context, name, (column + 0.5) * metre, (row + 0.5) * metre, metre / 2)
  context.setTransform(density, 0, 0, density, 0, 0)
  context.clearRect(0, 0, canvas.width, canvas.height)
  for (const [level, row, column, lit, ash] of run.flames)
    if (level == floor && lit <= k) cell(ash >= 0 && ash <= k ? "ash" : "flames", row, column)
  for (const [mark, burnt] of run.doors.filter(door => film.marks[door[0]].floor == floor))
    if (burnt <= t) film.marks[mark].cells.forEach(place => cell("burnt door", ...place))
  const named = film.rooms.filter(room => room[0] == floor)
  named.filter(room => !isStairwell(room)).forEach(room => write(context, room)) // over flames
  for (const [level, x, y, lit] of run.sources)
    if (level == floor && lit <= t) at("fire source", x, y)
  const here = bodies.filter(one => one.floor == floor && one.state != OUT)
  context.globalAlpha = 0.5
  for (const one of here.filter(one => one.state < OUT)) {
    const past = run.frames.slice(Math.max(0, k - film.trail / film.step), k + 1)
    const way = past.map(then => then[one.i]).filter(then => then.floor == floor)
    line(context, [...way, one], "faint", 1)
  }
  context.globalAlpha = 1
  for (const one of here.filter(one => one.toX >= 0)) {
    const way = [one, { x: one.toX, y: one.toY }]
    context.setLineDash([4, 3])
    line(context, way, "floor", 2.4) // seen on walls, too
    line(context, way, "ink", 0.9)
    context.setLineDash([])
    at("destination", one.toX, one.toY)
  }
  for (const { state, x, y, health } of here.sort((a, b) => a.state % DEAD - b.state % DEAD))
    at(STATES[state], x, y, state < OUT && colour(health))
  named.filter(isStairwell).forEach(room => write(context, room)) // over people
  for (const [{ x, y }, count] of together(here))
    write(context, [floor, x + 1.8 * size / dm, y + 1.4 * size / dm, 1.8 * size / dm, false, count])
  const chosen = here.find(one => one.i == run.chosen)
  if (!chosen) return
  for (const one of here) if (one.leader == chosen.i || chosen.leader == one.i)
    line(context, [one, chosen], "source", 1.5)
  at("ring", chosen.x, chosen.y)
}

// -- Beside the floors --------------------------------------------------------------

const AREAS = [["ink", [OUT, FOLLOWER, LEADER, DEAD]], ["inside", [OUT, FOLLOWER, LEADER]],
  ["exit", [OUT]]] // the dead above, those inside between, those out below
function chart(run, t) {
  const [canvas] = all(".time", run.article), context = canvas.getContext("2d")
  const wide = canvas.clientWidth, high = canvas.clientHeight - 15, at = wide * part(t)
  const box = (name, x, width, alpha = 1) => {
    Object.assign(context, { fillStyle: ink(name), globalAlpha: alpha })
    context.fillRect(x, 0, width, high)
  }
  context.setTransform(density, 0, 0, density, 0, 0)
  context.clearRect(0, 0, wide, high + 15)
  for (const [name, states] of AREAS) {
    const tops = run.counts.map(counts => high - high / run.people *
      states.reduce((sum, state) => sum + counts[state], 0))
    context.beginPath()
    context.lineTo(0, high)
    tops.forEach((top, k) => context.lineTo(part(when(k)) * wide, top))
    context.lineTo(wide, tops.at(-1))
    context.lineTo(wide, high)
    context.fillStyle = ink(name)
    context.fill()
  }
  box("page", at, wide, 0.65) // what is to come
  box("source", at - 1, 2)
  Object.assign(context, { fillStyle: ink("text"), font: "11px system-ui" })
  for (const k of range(5)) {
    context.textAlign = ["left", "center", "center", "center", "right"][k]
    context.fillText(`${Math.round(begin + k / 4 * (end - begin))} s`, k / 4 * wide, high + 12)
  }
  const [follow, lead, out, dead] = run.counts[frame(run, t)]
  const told = [out, follow + lead, dead]
  all(".status b", run.article).forEach((b, j) => { b.textContent = told[j] })
  all(".verdict", run.article)[0].classList.toggle("over", t >= end)
}
function words(robot) { // what it says
  if (robot.says == DONE) return ", its work is done"
  if (robot.toX < 0) return "" // it goes nowhere yet
  return `, says “${robot.says < 0 ? "follow me" : "go to " + film.marks[robot.says].name}”`
}
function facts(run, t) {
  const one = run.frames[frame(run, t)][run.chosen]
  if (!one) return taps.matches ? "Tap a person or a robot to know more." :
    "Click a person or a robot, or press N, to know more."
  const called = i => i < run.people ? `person ${i + 1}` : `robot ${i - run.people + 1}`
  const led = run.frames[frame(run, t)].filter(other => other.leader == one.i).length
  const where = `${called(one.i)}, floor ${one.floor + 1}`, leads = led ? `, leads ${led}` : ""
  const health = `health ${one.health} of 100`, t0 = since(run, one.i, one.state)
  const ago = `${t0 > begin ? "after" : "by"} ${Math.round(t0)} s`
  if (one.state == ROBOT) return where + leads + words(one)
  if (one.state == OUT) return `${called(one.i)}: got out ${ago}, ${health}`
  if (one.state == DEAD) return `${where}: died ${ago}`
  const does = one.stairwell >= 0 ? "on the stairs" : one.state == LEADER ? "a leader" :
    one.leader >= 0 ? `follows ${called(one.leader)}` : "a follower, lost its leader"
  return `${where}: ${does}${leads}, ${health}`
}
function legend() { // of what occurs in this film
  const some = test => film.runs.some(test), [aside] = all("aside")
  const is = state => some(run => run.counts.some(counts => counts[state]))
  const occurs = {
    follower: is(FOLLOWER), leader: is(LEADER), "died here": is(DEAD), robot: is(ROBOT),
    destination: is(ROBOT), "fire source": some(run => run.sources.length),
    flames: some(run => run.flames.length),
    ash: some(run => run.flames.some(cell => cell[4] >= 0)),
    "burnt door": some(run => run.doors.length) }
  for (const name of Object.keys(occurs).filter(name => occurs[name])) {
    const icon = Object.assign(document.createElement("canvas"), { width: 40, height: 40 })
    const entry = document.createElement("span")
    const full = name == "follower" || name == "leader" ? colour(100) : ""
    icon.repaint = () => put(icon.getContext("2d"), name, 20, 20, 10, full)
    entry.append(icon, " " + name)
    aside.append(entry)
  }
  aside.insertAdjacentHTML("beforeend", `<span>health: 0 <i style="width: 90px;
    background: linear-gradient(90deg, ${steps})"></i> 100</span>
    <span>faint line: walked in ${film.trail} s</span>${
    is(ROBOT) ? "<span>number: so many robots on one spot</span>" : ""}<span>at the slider:
    <i class="source"></i> fire source, <i class="ink"></i> death${
    film.runs[1] ? "; below it: of the second" : ""}</span>`)
}
function marks(run, which) { // at the slider
  const died = range(run.people).map(i => since(run, i, DEAD))
  const fires = run.sources.map(fire => ["source", "fire source", fire[3]])
  const both = [...fires, ...died.map(t => ["ink", "death", t])]
  for (const [ink, what, t] of both.filter(([, , t]) => t >= begin)) {
    const tick = document.createElement("i")
    tick.style.left = `calc(8px + ${part(t)} * (100% - 16px))`
    tick.title = `${what} after ${Math.round(t)} s`
    tick.className = ink
    tick.dataset.run = which
    slider.before(tick)
  }
}

// -- Playing ------------------------------------------------------------------------

let time = begin, playing = false, held = false, before = 0, alone = -1
function show() {
  for (const run of film.runs.filter(run => !run.article.hidden)) {
    const now = bodies(run, time)
    all("figure", run.article).forEach((figure, floor) =>
      figure.hidden || paint(run, floor, figure.lastElementChild, now, time))
    chart(run, time)
    all(".facts", run.article)[0].textContent = facts(run, time)
  }
  slider.value = time
  told.value = `${Math.round(time)} of ${Math.round(end)} s`
  slider.setAttribute("aria-valuetext", told.value)
}
function seek(t) {
  time = Math.max(begin, Math.min(t, end))
  show()
}
function choose(run, i) {
  run.chosen = run.chosen == i ? -1 : i
  show()
}
function play(on) {
  if (on && time >= end) time = begin
  if (on && !playing) requestAnimationFrame(now => advance(before = now))
  playing = on
  button.textContent = on ? "Pause" : "Play"
}
function advance(now) {
  if (playing && !held) seek(time + (now - before) / 1000 * speed.value)
  if (playing && !held && time >= end) play(false)
  before = now
  if (playing) requestAnimationFrame(advance)
}
function layout() { // floors as large as the window lets them be
  const radios = all("[name=shown]"), [main] = all("main"), bar = all("footer")[0].offsetHeight
  if (small.matches && radios[0].checked) radios[1].checked = true
  const chosen = radios.findIndex(radio => radio.checked) - 1
  all("article").forEach((article, k) => { article.hidden = chosen >= 0 && k != chosen })
  all("footer i").forEach(i => {
    i.hidden = chosen < 0 ? i.dataset.run > 1 : i.dataset.run != chosen
  })
  all(".floors").forEach(grid => {
    grid.style.display = "none"
    all("figure", grid).forEach((figure, floor) => { figure.hidden = alone >= 0 && alone != floor })
  })
  const floors = alone < 0 ? all("figure").length / film.runs.length : 1
  const shown = all("article:not([hidden])"), narrow = root.clientWidth < 700
  const [header] = all("header")
  const ways = [false, true].slice(0, narrow ? 1 : 2).flatMap(beside => {
    main.classList.toggle("beside", beside)
    const stacked = beside ? shown.length : 1, told = all(".told:not([hidden] *)")
    const words = Math.max(...told.map(one => one.offsetHeight))
    const rest = small.matches ? header.offsetHeight + bar + 34 :
      document.body.offsetHeight - main.offsetHeight + 8
    const high = (root.clientHeight - rest) / stacked - (beside ? 8 : words)
    if (beside && words > high) return []
    const wide = shown[0].clientWidth - (beside ? told[0].offsetWidth + 16 : 0)
    return range(narrow ? 1 : floors).map(k => ({ beside, columns: k + 1,
      metre: Math.min((wide / (k + 1) - 6) / across,
        narrow ? Infinity : (Math.max(160, high) / Math.ceil(floors / (k + 1)) - 28) / down) }))
  })
  const best = ways.reduce((a, b) => b.metre > a.metre ? b : a)
  main.classList.toggle("beside", best.beside)
  metre = best.metre
  root.style.setProperty("--bar", bar + "px")
  size = Math.max(3.4, Math.min(0.42 * metre, 7))
  density = devicePixelRatio * Math.min(4, visualViewport.scale)
  all(".floors").forEach(grid => Object.assign(grid.style,
    { display: "", gridTemplateColumns: `repeat(${best.columns}, ${metre * across}px)` }))
  for (const canvas of all("article canvas")) {
    if (canvas.className != "time") canvas.style.height = metre * down + "px"
    canvas.width = canvas.clientWidth * density
    canvas.height = canvas.clientHeight * density
  }
  show()
}
function touch(run, floor, { offsetX, offsetY, pointerType }) { // a body; else play or pause
  const away = one => Math.hypot(one.x * metre / 10 - offsetX, one.y * metre / 10 - offsetY)
  const here = bodies(run, time).filter(one => one.floor == floor && one.state != OUT)
  const [nearest] = here.sort((a, b) => away(a) - away(b))
  const near = size + (pointerType == "touch" ? 14 : 6)
  if (nearest && away(nearest) < near) choose(run, nearest.i)
  else play(!playing)
}
function press(event) { // but what the control in focus does with a key, it does
  const { key, target } = event, { step } = film, faster = { "+": 1, "-": -1 }[key]
  const own = target == speed || target.matches("button, [type=radio]") && key == " " ||
    target.matches("[type=radio]") && /^Arrow/.test(key)
  const to = { ArrowLeft: time - step, ArrowRight: time + step, PageDown: time - 20,
    PageUp: time + 20, Home: begin, End: end }[key]
  if (own || event.ctrlKey || event.altKey || event.metaKey) return
  if (to !== undefined) seek(to)
  else if (key == " ") event.repeat || play(!playing)
  else if (faster) speed.selectedIndex = Math.max(0, Math.min(4, speed.selectedIndex + faster))
  else if (/^n$/i.test(key)) film.runs.filter(run => !run.article.hidden).forEach(chooseNext)
  else return
  event.preventDefault()
}
function chooseNext(run) { // the next who is inside, by its number
  const inside = run.frames[frame(run, time)].filter(one => ![OUT, DEAD].includes(one.state))
  choose(run, inside.find(one => one.i > run.chosen)?.i ?? -1)
}
function start() {
  film.runs.forEach(marks)
  legend()
  film.runs.forEach(run => all("figure", run.article).forEach((figure, floor) => {
    figure.lastElementChild.onclick = event => touch(run, floor, event)
    figure.firstElementChild.onclick = () => {
      alone = alone < 0 ? floor : -1
      layout()
    }
  }))
  const recolour = () => {
    inks = {}
    all("aside canvas").forEach(icon => icon.repaint())
    layout()
  }
  recolour()
  matchMedia("(prefers-color-scheme: dark)").onchange = recolour
  all("fieldset")[0].onchange = onresize = visualViewport.onresize = layout
  button.onclick = () => play(!playing)
  slider.oninput = () => seek(+slider.value)
  slider.onpointerdown = () => { held = true }
  onpointerup = onpointercancel = () => { held = false }
  onkeydown = press
  play(!matchMedia("(prefers-reduced-motion)").matches)
}
Promise.all(film.runs.map(read)).then(start)
