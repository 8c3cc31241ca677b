/**
 * The keys that do something once, with the words that help says about them: one table for both, so that neither can be wrong.
 * Keys that move while they are held are those of `controls.js`; their words stand here too.
 */

import { element, toast } from "twinray/announce.js";
import { keyIsTaken } from "twinray/controls.js";

/** @import { Actions } from "twinray/actions.js" */
/** @import { Mode } from "twinray/types.js" */
/** @typedef {{ keys: string[], shown?: string[], says: string, run: (event: KeyboardEvent) => void }} Shortcut */
/** @typedef {{ title: string, rows: [string[], string][] }} HelpGroup */

const WELCOME_MILLISECONDS = 6000;

const MOVES = /** @type {HelpGroup} */ ({
    title: "Movement",
    rows: [
        [["W", "A", "S", "D"], "Move ahead, left, back, right"],
        [["Q", "E"], "Move down, up"],
        [["↑", "↓"], "Move ahead, back"],
        [["←", "→"], "Turn, or orbit"],
        [["Page Up", "Page Down"], "Tilt up, down"],
        [["Shift"], "Faster, while held"],
    ],
});

const GESTURES = /** @type {HelpGroup} */ ({
    title: "Mouse and fingers",
    rows: [
        [["Drag"], "Orbit, or look around"],
        [["Right drag"], "Pan; also Shift and drag"],
        [["Wheel"], "Nearer to what is under the cursor"],
        [["Double-click"], "Focus on what is there"],
        [["Two fingers"], "Pan, and pinch to come nearer"],
    ],
});

/**
 * @param {Actions} act
 * @returns {{ title: string, shortcuts: Shortcut[] }[]}
 */
function table(act) {
    /** @type {(keys: string[], says: string, run: (event: KeyboardEvent) => void, shown?: string[]) => Shortcut} */
    const key = (keys, says, run, shown) => ({ keys, says, run, shown });
    return [
        {
            title: "View",
            shortcuts: [
                key(["h"], "Home", act.home),
                key(["z"], "The whole scene from outside", act.overview),
                key([..."123456789"], "Camera of the scene", (event) => act.camera(Number(event.key) - 1), [
                    "1",
                    "…",
                    "9",
                ]),
                key(["o"], "Orbit or fly", act.mode),
                key([",", "."], "Field of view narrower, wider", (event) => act.fov(event.key === "," ? -1 : 1)),
                key(["<", ">"], "Fly slower, faster", (event) => act.speed(event.key === "<" ? -1 : 1)),
            ],
        },
        {
            title: "Picture",
            shortcuts: [
                key(["-", "+", "="], "Darker, brighter", (event) => act.exposure(event.key === "-" ? -1 : 1), [
                    "−",
                    "+",
                ]),
                key(["x"], "Automatic exposure", act.autoExposure),
                key(["t"], "Next tone curve", act.curve),
                key(["g"], "Save the picture as PNG", act.screenshot),
            ],
        },
        {
            title: "Illuminance",
            shortcuts: [
                key(["l"], "False colour", act.falseColour),
                key(["k"], "Logarithmic or linear scale", act.scale),
                key(["c"], "Cells", act.cells),
                key(["r"], "Take readings", act.picking),
                key(["Enter"], "Reading in the middle", act.pickMiddle, ["Enter"]),
            ],
        },
        {
            title: "Page",
            shortcuts: [
                key([" "], "Pause or resume the solve", act.pause, ["Space"]),
                key(["u"], "Copy a link to this view", act.link),
                key(["f"], "Full screen", act.fullscreen),
                key(["p"], "Panel", act.panel),
                key(["?"], "This help", act.help),
                key(["Escape"], "End readings", act.escape, ["Esc"]),
            ],
        },
    ];
}

/**
 * Listens to keys and fills the help dialog.
 * @param {Actions} act
 */
export function setUpShortcuts(act) {
    const groups = table(act);
    const byKey = new Map(groups.flatMap(({ shortcuts }) => shortcuts.flatMap((s) => s.keys.map((key) => [key, s]))));
    window.addEventListener("keydown", (event) => {
        // A pressed key repeats; a switch that flutters helps nobody, while steps may repeat.
        if (keyIsTaken(event) || (event.repeat && !/^[-+=,.<>]$/.test(event.key))) return;
        const shortcut = byKey.get(event.key.length === 1 ? event.key.toLowerCase() : event.key);
        if (!shortcut) return;
        if (event.key === "Enter" && event.target !== element("view")) return;
        event.preventDefault();
        shortcut.run(event);
    });

    const rows = groups.map(({ title, shortcuts }) => ({
        title,
        rows: shortcuts.map(({ keys, shown, says }) => [shown ?? keys.map((key) => key.toUpperCase()), says]),
    }));
    element("help-body").append(
        ...[GESTURES, MOVES, ...rows].map((group) => section(/** @type {HelpGroup} */ (group))),
    );
}

/** Opens the help, or closes it. */
export function toggleHelp() {
    const dialog = /** @type {HTMLDialogElement} */ (element("help"));
    if (dialog.open) dialog.close();
    else dialog.showModal();
}

/** Says how to move, to someone who sees the page for the first time. @param {Mode} mode */
export function welcome(mode) {
    const drag = mode === "orbit" ? "Drag to orbit" : "Drag to look around";
    const touch = matchMedia("(pointer: coarse)").matches;
    const move = touch ? "pinch to come nearer, double-tap to focus" : "W A S D to move, ? for all keys";
    toast(`${drag}, ${move}`, WELCOME_MILLISECONDS);
}

/** @param {HelpGroup} group */
function section({ title, rows }) {
    const node = document.createElement("section");
    const heading = document.createElement("h3");
    heading.textContent = title;
    const list = document.createElement("dl");
    for (const [keys, says] of rows) {
        const row = document.createElement("div");
        const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
        dt.textContent = says;
        keys.forEach((key, i) => {
            const cap = document.createElement(key === "…" ? "span" : "kbd");
            cap.textContent = key;
            dd.append(...(i > 0 ? [" ", cap] : [cap]));
        });
        row.append(dt, dd);
        list.append(row);
    }
    node.append(heading, list);
    return node;
}
