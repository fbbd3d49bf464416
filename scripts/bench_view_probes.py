"""What a page measures of itself, by its own clock: scripts that ``scripts/bench_view.py`` runs in it."""

from __future__ import annotations

NO_DRAWING = """
for (const call of ["clear", "drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"])
    WebGL2RenderingContext.prototype[call] = () => {};
"""
"""Leaves out what a graphics card would do, which without one takes most of a processor's time."""

FIRST_PICTURE = """
(() => {
    const gl = WebGL2RenderingContext.prototype, draw = gl.drawElements;
    let seen = false;
    gl.drawElements = function (mode, count, ...rest) {
        if (count > 100 && !seen) {  // the ground and the background have fewer corners
            seen = true;
            const shown = () => { window.robotShown = performance.timeOrigin + performance.now(); };
            requestAnimationFrame(() => requestAnimationFrame(shown));
        }
        return draw.call(this, mode, count, ...rest);
    };
})();
"""
"""Sets ``robotShown``: when the frame after the first one with a surface of the robot begins, ms since 1970."""

POSES = """
(() => {
    const gl = WebGL2RenderingContext.prototype, find = gl.getUniformLocation, set = gl.uniformMatrix4fv;
    const names = new WeakMap(), known = new Set();
    window.posed = [];
    window.painted = [];
    let pressed = null;
    gl.getUniformLocation = function (program, name) {
        const location = find.call(this, program, name);
        if (location) names.set(location, name);
        return location;
    };
    gl.uniformMatrix4fv = function (location, transpose, values, ...rest) {
        if (location && names.get(location) === "modelViewMatrix") {
            const pose = Array.from(values, (value) => value.toFixed(6)).join();
            if (!known.has(pose)) {
                known.add(pose);
                if (pressed !== null) {
                    const start = pressed;
                    pressed = null;
                    window.posed.push(performance.now() - start);
                    const shown = () => { window.painted.push(performance.now() - start); };
                    requestAnimationFrame(() => requestAnimationFrame(shown));
                }
            }
        }
        return set.call(this, location, transpose, values, ...rest);
    };
    addEventListener("keydown", () => { pressed = performance.now(); }, { capture: true });
})();
"""
"""Fills ``posed`` and ``painted``: ms from a key to the first surface that is drawn at a pose at which none was drawn
before, and to the frame after that. The eye must be still."""

NUMBERS = """() => {
    const readout = () => document.querySelector('[data-dh2sim="readout"]')?.textContent;
    const before = readout();
    window.moved = new Promise((done, failed) => {
        let pressed;
        addEventListener("keydown", () => { pressed = performance.now(); }, { capture: true, once: true });
        const observer = new MutationObserver(() => {
            if (readout() === before || pressed === undefined) return;
            observer.disconnect();
            done(performance.now() - pressed);
        });
        observer.observe(document.body, { subtree: true, childList: true, characterData: true });
        setTimeout(() => failed(new Error("the pose did not change")), 20000);
    });
}"""
"""Promises ``moved``: ms from the next key to the pose that the page then shows in numbers."""

FRAMES = """(seconds) => new Promise((done) => {
    const start = performance.now();
    let count = 0;
    const frame = () => {
        count += 1;
        const passed = (performance.now() - start) / 1000;
        if (passed < seconds) requestAnimationFrame(frame); else done(count / passed);
    };
    requestAnimationFrame(frame);
})"""
"""Frames a second."""
