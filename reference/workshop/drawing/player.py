"""The page around a film in HTML: a canvas, a play button and a slider; no links.

Each frame is `[left, top, PNG]`, a patch on the frame before it; every KEY_FRAMES-th is
whole, so that a jump starts at the last whole frame before its place.
"""

from string import Template

HEAD = Template("""<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<title>$title</title>
<style>
  body { font: 16px sans-serif; color: #23272e }
  body { max-width: ${width}px; margin: 1em auto }
  canvas { width: 100% }
  form { display: flex; gap: 1em; align-items: center }
  input { flex: 1 }
  button { font: inherit; width: 5em }
</style>
<canvas width="$width" height="$height" role="img" aria-label="$title"></canvas>
<form><button type="button">Pause</button>
<input type="range" min="0" value="0" aria-label="frame"><output></output></form>
<script>
const frames = [
""")

FOOT = Template("""];
const pace = $pace, key = $key
const page = document.querySelector("canvas").getContext("2d")
const button = document.querySelector("button")
const slider = document.querySelector("input")
const images = frames.map(([, , png]) => {
  const image = new Image()
  image.src = "data:image/png;base64," + png
  return image
})
let shown = -1, timer = null

function show(k) {
  for (let i = k == shown + 1 ? k : k - k % key; i <= k; i++)
    page.drawImage(images[i], frames[i][0], frames[i][1])
  slider.value = shown = k
  document.querySelector("output").value = (k + 1) + " / " + frames.length
}
function pause() {
  clearInterval(timer)
  timer = null
  button.textContent = "Play"
}
function play() {
  if (shown == frames.length - 1) show(0)
  button.textContent = "Pause"
  timer = setInterval(() => {
    if (shown < frames.length - 1) show(shown + 1)
    else pause()
  }, pace)
}
slider.max = frames.length - 1
slider.oninput = () => { pause(); show(+slider.value) }
button.onclick = () => timer ? pause() : play()
Promise.all(images.map(image => image.decode())).then(() => { show(0); play() })
</script>
</html>
""")
