/**
 * A solve that only counts, for tests of the page; `window.standinLive` lets a test say what comes next.
 */

/** @import { Status, Walk } from "twinray/types.js" */

export class Live {
    /** @type {Status} */
    #status = { state: "solving", rays: 1_260_000, rate: 1_030_000, error: 0.046, seconds: 5, goal: { error: 0.02 } };
    #handlers;
    #timer;

    /**
     * @param {Walk} _walk
     * @param {{ onLight: (light: unknown) => void, onStatus: (status: Status) => void }} handlers
     */
    constructor(_walk, handlers) {
        this.#handlers = handlers;
        this.#timer = setInterval(() => this.#advance(), 500);
        Object.assign(window, { standinLive: this });
        handlers.onStatus(this.#status);
    }

    /** @param {Partial<Status>} change */
    tell(change) {
        this.#status = { ...this.#status, ...change };
        this.#handlers.onStatus(this.#status);
    }

    #advance() {
        if (this.#status.state !== "solving") return;
        const rays = this.#status.rays + 515_000;
        const error = 0.046 * Math.sqrt(1_260_000 / rays);
        this.#handlers.onLight({ rays });
        this.tell({ rays, error, seconds: this.#status.seconds + 0.5, state: error < 0.02 ? "finished" : "solving" });
    }

    async pause() {
        this.tell({ state: "paused" });
    }

    async resume() {
        this.tell({ state: "solving" });
    }

    close() {
        clearInterval(this.#timer);
    }
}
