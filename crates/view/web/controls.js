/**
 * From gestures to movements of the camera: mouse, touch and pen through pointer events, wheel, and keys that are held. What a
 * key does once stands in `shortcuts.js`. Between events nothing runs, except while keys of flight are down.
 */

import { along, dot } from "twinray/vec.js";

/** @import { Camera } from "twinray/camera.js" */
/** @import { Settings } from "twinray/settings.js" */
/** @import { Ticker } from "twinray/ticker.js" */
/** @import { Vec3 } from "twinray/types.js" */
/** @typedef {{ x: number, y: number }} Place in CSS pixels from the picture's upper left corner */
/** @typedef {{ start: Place, last: Place, pan: boolean, moved: boolean, type: string }} Held */

/** Radians that an orbit turns over the picture's height. */
const ORBIT_SPEED = Math.PI;
/** Radians a second that arrow keys turn. */
const TURN_SPEED = 1.2;
/** Radii of the scene a second that keys fly, at speed 1: about a walk's pace in a room. */
const FLY_SPEED = 0.25;
const FASTER = 4;
/** A wheel's notch, about 100 pixels, comes an eighth nearer. */
const WHEEL_SPEED = 0.00135;
/** A pause that ends a turn of the wheel, and with it the hold on the point under the cursor. */
const WHEEL_PAUSE = 300;
/** Fingers shake, and a mouse does so a little: less movement than this is a click, in pixels. */
const CLICK_PIXELS = { mouse: 4, touch: 10 };
const DOUBLE_CLICK = { milliseconds: 350, pixels: 24 };

/** Keys that move while they are held, by place on the keyboard, whatever is printed on them: right, up, forward; turn, tilt. */
const HELD_KEYS = /** @type {Record<string, { move?: Vec3, turn?: [number, number] }>} */ ({
    KeyW: { move: [0, 0, 1] },
    KeyS: { move: [0, 0, -1] },
    KeyA: { move: [-1, 0, 0] },
    KeyD: { move: [1, 0, 0] },
    KeyE: { move: [0, 1, 0] },
    KeyQ: { move: [0, -1, 0] },
    ArrowUp: { move: [0, 0, 1] },
    ArrowDown: { move: [0, 0, -1] },
    ArrowLeft: { turn: [-1, 0] },
    ArrowRight: { turn: [1, 0] },
    PageUp: { turn: [0, 1] },
    PageDown: { turn: [0, -1] },
});

/**
 * Whether a key belongs to the element it was pressed in: letters to fields of text, arrows also to sliders and lists.
 * @param {KeyboardEvent} event
 */
export function keyIsTaken(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return true;
    const element = event.target;
    if (!(element instanceof HTMLElement)) return false;
    if (element.closest("dialog") || element.isContentEditable) return true;
    const isSelect = element instanceof HTMLSelectElement;
    if (isSelect || element instanceof HTMLTextAreaElement) return true;
    if (element instanceof HTMLInputElement) {
        if (element.type === "number" || element.type === "text") return true;
        return /^(Arrow|Page|Home|End| )/.test(event.key);
    }
    if (element.closest("#panel") && /^(Arrow|Page)/.test(event.key)) return true;
    return element.matches("button, summary, a") && (event.key === " " || event.key === "Enter");
}

export class Controls {
    #canvas;
    #camera;
    #settings;
    #ticker;
    #radius;
    #actions;
    /** @type {Map<number, Held>} */
    #pointers = new Map();
    /** @type {Set<string>} */
    #keys = new Set();
    #fast = false;
    /** @type {{ time: number, place: Place } | null} */
    #lastClick = null;
    /** @type {{ time: number, point: Vec3 | null, place: Place } | null} */
    #wheel = null;
    #abort = new AbortController();

    /**
     * @param {HTMLCanvasElement} canvas
     * @param {Camera} camera
     * @param {Settings} settings
     * @param {Ticker} ticker
     * @param {number} radius of the scene
     * @param {{ depth: (place: Place) => Promise<Vec3 | null>, click: (place: Place) => void, doubleClick: (place: Place) => void,
     *   hover: (place: Place | null) => void }} actions what is seen at a place, and what a click there does
     */
    constructor(canvas, camera, settings, ticker, radius, actions) {
        this.#canvas = canvas;
        this.#camera = camera;
        this.#settings = settings;
        this.#ticker = ticker;
        this.#radius = radius;
        this.#actions = actions;
        const { signal } = this.#abort;
        canvas.addEventListener("pointerdown", this.#down, { signal });
        canvas.addEventListener("pointermove", this.#move, { signal });
        canvas.addEventListener("pointerup", this.#up, { signal });
        canvas.addEventListener("pointercancel", this.#cancel, { signal });
        canvas.addEventListener("lostpointercapture", this.#cancel, { signal });
        canvas.addEventListener("pointerleave", () => this.#actions.hover(null), { signal });
        canvas.addEventListener("wheel", this.#turnWheel, { signal, passive: false });
        canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
        window.addEventListener("keydown", this.#keyDown, { signal });
        window.addEventListener("keyup", this.#keyUp, { signal });
        window.addEventListener("blur", this.#releaseKeys, { signal });
        document.addEventListener("visibilitychange", this.#releaseKeys, { signal });
    }

    dispose() {
        this.#abort.abort();
        this.#releaseKeys();
    }

    /** @param {MouseEvent} event @returns {Place} */
    #place(event) {
        const box = this.#canvas.getBoundingClientRect();
        return { x: event.clientX - box.left, y: event.clientY - box.top };
    }

    #height() {
        return this.#canvas.clientHeight || 1;
    }

    // Pointers: one turns, or pans where asked to; two pan and come nearer together.

    #down = (/** @type {PointerEvent} */ event) => {
        if (event.pointerType === "mouse" && event.button > 2) return;
        const place = this.#place(event);
        const pan = event.pointerType === "mouse" && (event.button !== 0 || event.shiftKey);
        this.#pointers.set(event.pointerId, { start: place, last: place, pan, moved: false, type: event.pointerType });
        // Two fingers are never a click, whatever they do then.
        if (this.#pointers.size > 1) for (const held of this.#pointers.values()) held.moved = true;
        this.#canvas.setPointerCapture(event.pointerId);
        this.#canvas.focus({ preventScroll: true });
        this.#canvas.dataset.drag = pan ? "pan" : "turn";
        this.#actions.hover(null);
        // The middle button would start the browser's own scrolling.
        if (event.button === 1) event.preventDefault();
    };

    #move = (/** @type {PointerEvent} */ event) => {
        const held = this.#pointers.get(event.pointerId);
        const place = this.#place(event);
        if (!held) {
            if (event.pointerType !== "touch") this.#actions.hover(place);
            return;
        }
        const slack = held.type === "touch" ? CLICK_PIXELS.touch : CLICK_PIXELS.mouse;
        if (!held.moved && Math.hypot(place.x - held.start.x, place.y - held.start.y) < slack) return;
        held.moved = true;
        const before = [...this.#pointers.values()].map(({ last }) => last);
        const [dx, dy] = [place.x - held.last.x, place.y - held.last.y];
        held.last = place;
        if (this.#pointers.size === 1) this.#drag(held, dx / this.#height(), dy / this.#height());
        else if (this.#pointers.size === 2)
            this.#pinch(
                before,
                [...this.#pointers.values()].map(({ last }) => last),
            );
    };

    #up = (/** @type {PointerEvent} */ event) => {
        const held = this.#pointers.get(event.pointerId);
        this.#cancel(event);
        if (!held || held.moved || held.pan) return;
        const place = this.#place(event);
        const last = this.#lastClick;
        const again =
            last !== null &&
            event.timeStamp - last.time < DOUBLE_CLICK.milliseconds &&
            Math.hypot(place.x - last.place.x, place.y - last.place.y) < DOUBLE_CLICK.pixels;
        this.#lastClick = again ? null : { time: event.timeStamp, place };
        if (again) this.#actions.doubleClick(place);
        else this.#actions.click(place);
    };

    #cancel = (/** @type {PointerEvent} */ event) => {
        this.#pointers.delete(event.pointerId);
        if (this.#pointers.size === 0) delete this.#canvas.dataset.drag;
    };

    /** @param {Held} held @param {number} dx @param {number} dy shares of the picture's height */
    #drag(held, dx, dy) {
        if (held.pan) return this.#camera.pan(dx, -dy);
        if (this.#settings.values.mode === "orbit") return this.#camera.orbit(dx * ORBIT_SPEED, -dy * ORBIT_SPEED);
        // What is seen follows the pointer, as in a street view.
        const { fov } = this.#camera.view;
        this.#camera.look(-dx * fov, dy * fov);
    }

    /** @param {Place[]} before @param {Place[]} after */
    #pinch([a, b], [c, d]) {
        const [from, to] = [Math.hypot(a.x - b.x, a.y - b.y), Math.hypot(c.x - d.x, c.y - d.y)];
        const middle = { x: (c.x + d.x) / 2, y: (c.y + d.y) / 2 };
        this.#camera.pan((c.x + d.x - a.x - b.x) / 2 / this.#height(), -(c.y + d.y - a.y - b.y) / 2 / this.#height());
        if (from > 8 && to > 8) this.#camera.dolly(this.#atTarget(middle), from / to);
    }

    /** The point of the plane through the target that is seen at a place. @param {Place} place @returns {Vec3} */
    #atTarget({ x, y }) {
        const camera = this.#camera;
        const ray = camera.ray((2 * x) / (this.#canvas.clientWidth || 1) - 1, 1 - (2 * y) / this.#height());
        return along(camera.pose.eye, ray, camera.distance / Math.max(dot(ray, camera.pose.forward), 0.05));
    }

    #turnWheel = (/** @type {WheelEvent} */ event) => {
        event.preventDefault();
        const place = this.#place(event);
        // A pinch on a touch pad arrives as a wheel with Ctrl, in steps of few pixels.
        const pixels = event.deltaY * [1, 33, 400][event.deltaMode] * (event.ctrlKey ? 6 : 1);
        const factor = Math.exp(Math.min(Math.max(pixels, -300), 300) * WHEEL_SPEED);
        const now = event.timeStamp;
        const last = this.#wheel;
        if (!last || now - last.time > WHEEL_PAUSE || Math.hypot(place.x - last.place.x, place.y - last.place.y) > 4) {
            // Until the renderer tells what is under the cursor, the depth of the target has to do.
            /** @type {{ time: number, point: Vec3 | null, place: Place }} */
            const turn = { time: now, point: null, place };
            this.#wheel = turn;
            this.#actions.depth(place).then((point) => (turn.point = point));
        }
        const turn = /** @type {{ time: number, point: Vec3 | null, place: Place }} */ (this.#wheel);
        turn.time = now;
        this.#camera.dolly(turn.point ?? this.#atTarget(place), factor);
    };

    // Keys that are held.

    #keyDown = (/** @type {KeyboardEvent} */ event) => {
        this.#fast = event.shiftKey;
        if (event.metaKey) this.#releaseKeys();
        if (keyIsTaken(event) || !HELD_KEYS[event.code]) return;
        event.preventDefault();
        this.#keys.add(event.code);
        this.#ticker.add(this.#fly);
    };

    #keyUp = (/** @type {KeyboardEvent} */ event) => {
        this.#fast = event.shiftKey;
        this.#keys.delete(event.code);
        // macOS tells nothing of keys that are let go while Command is down; they would be held for ever.
        if (event.key === "Meta") this.#releaseKeys();
    };

    #releaseKeys = () => this.#keys.clear();

    #fly = (/** @type {number} */ seconds) => {
        if (this.#keys.size === 0) return false;
        const faster = this.#fast ? FASTER : 1;
        const step = FLY_SPEED * this.#radius * this.#settings.values.speed * faster * seconds;
        /** @type {Vec3} */
        let way = [0, 0, 0];
        let [turn, tilt] = [0, 0];
        for (const code of this.#keys) {
            way = along(way, HELD_KEYS[code].move ?? [0, 0, 0], step);
            turn += HELD_KEYS[code].turn?.[0] ?? 0;
            tilt += HELD_KEYS[code].turn?.[1] ?? 0;
        }
        if (way.some((x) => x !== 0)) this.#camera.move(way);
        if (turn || tilt) {
            const angle = TURN_SPEED * seconds;
            if (this.#settings.values.mode === "orbit") this.#camera.orbit(turn * angle, tilt * angle);
            else this.#camera.look(turn * angle, tilt * angle);
        }
        return true;
    };
}
