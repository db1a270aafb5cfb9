// Input on the canvas: pointers, wheel and keys, as calls of `actions`: rotate, move, zoomAt, hover and click.

function listen(canvas, { rotate, move, zoomAt, hover, click }) {
  const touching = new Map();
  let travelled = 0, hovered = null, isHovering = false;
  canvas.addEventListener("pointerdown", (event) => {
    if (!touching.size) travelled = 0;
    touching.set(event.pointerId, [event.offsetX, event.offsetY]);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const was = touching.get(event.pointerId), now = [event.offsetX, event.offsetY];
    if (!was) {
      // Once per frame at the most.
      hovered = now;
      if (!isHovering) { isHovering = true; requestAnimationFrame(() => { isHovering = false; hover(...hovered); }); }
      return;
    }
    const dx = now[0] - was[0], dy = now[1] - was[1];
    travelled += Math.hypot(dx, dy);
    if (touching.size === 1 && travelled > 4) {
      if (event.shiftKey || event.buttons > 1) move(dx, dy);
      else rotate(0.008 * dx, 0.008 * dy);
    } else if (touching.size === 2) {
      const [other] = [...touching].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const length = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      move(dx / 2, dy / 2);
      zoomAt(length(now) / length(was), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    }
    touching.set(event.pointerId, now);
  });
  canvas.addEventListener("pointerup", (event) => {
    const wasAlone = touching.size === 1;
    touching.delete(event.pointerId);
    if (wasAlone && travelled <= 4 && event.button === 0) click(event.offsetX, event.offsetY, event.shiftKey);
  });
  canvas.addEventListener("pointercancel", (event) => touching.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomAt(Math.exp(-(event.deltaMode ? 30 : 1) * event.deltaY * 0.0015), event.offsetX, event.offsetY);
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const factor = { "+": 1.2, "-": 1 / 1.2 }[event.key];
    if (turns) rotate(0.1 * turns[0], 0.1 * turns[1]);
    else if (factor) zoomAt(factor, canvas.clientWidth / 2, canvas.clientHeight / 2);
    else return;
    event.preventDefault();
  });
}
