/**
 * Everything a visitor can set, in one place that tells of changes: panel, shortcuts and links write here, and the renderer, the
 * panel and the link follow. Who set a value never matters to who reads it.
 */

/** @import { Values } from "twinray/types.js" */

/** @type {Readonly<Values>} */
export const DEFAULTS = Object.freeze({
    exposure: null,
    curve: "agx",
    falseColour: false,
    range: null,
    logarithmic: true,
    cells: false,
    map: "turbo",
    mode: "orbit",
    speed: 1,
    picking: false,
});

export class Settings {
    /** @type {Values} */
    #values;
    /** @type {((values: Values, changed: Partial<Values>) => void)[]} */
    #listeners = [];

    /** @param {Partial<Values>} values what differs from the defaults */
    constructor(values = {}) {
        this.#values = { ...DEFAULTS, ...values };
    }

    get values() {
        return this.#values;
    }

    /** Sets some values and tells all who listen which of them are new. @param {Partial<Values>} values */
    set(values) {
        const changed = Object.fromEntries(
            Object.entries(values).filter(
                ([name, value]) => !same(value, this.#values[/** @type {keyof Values} */ (name)]),
            ),
        );
        if (Object.keys(changed).length === 0) return;
        this.#values = { ...this.#values, ...changed };
        for (const listener of this.#listeners) listener(this.#values, changed);
    }

    /** Calls `listener` now, with everything as changed, and after each change. @param {(values: Values, changed: Partial<Values>) => void} listener */
    listen(listener) {
        this.#listeners.push(listener);
        listener(this.#values, this.#values);
    }
}

/** @param {unknown} a @param {unknown} b */
function same(a, b) {
    return Array.isArray(a) && Array.isArray(b)
        ? a.length === b.length && a.every((x, i) => x === b[i])
        : Object.is(a, b);
}
