// The connection to the server that solves: light as it comes, and how far the solve is.

import { readContainer } from "twinray/walk.js";

/** @import { Container, Status, Walk } from "twinray/types.js" */
/** Milliseconds between questions for the state of the solve, and before a lost server is asked again. */
const STATUS_INTERVAL = 500;
const RETRY = 1500;

export class Live {
    /** Number of the last message; a restarted server counts anew. */
    #number = 0;
    #closed = false;
    /** @type {Status|null} */
    #last = null;
    #lost = false;
    #stop = new AbortController();

    /**
     * @param {Walk} walk
     * @param {{onLight: (light: Container) => void, onStatus: (status: Status) => void}} listener
     */
    constructor(walk, listener) {
        this.base = walk.base;
        this.id = walk.scene.header.id;
        this.listener = listener;
        this.#follow();
        this.#watch();
    }

    /** Asks the solver to rest. */
    async pause() {
        await this.#post("pause");
    }

    /** Asks the solver to go on. */
    async resume() {
        await this.#post("resume");
    }

    close() {
        this.#closed = true;
        this.#stop.abort();
    }

    /** @param {string} wish */
    async #post(wish) {
        try {
            await fetch(this.base + wish, { method: "POST", signal: this.#stop.signal });
            await this.#status();
        } catch {
            this.#lose();
        }
    }

    /** Light, message by message; each request waits at the server until there is one. */
    async #follow() {
        while (!this.#closed) {
            await shown();
            try {
                const answer = await fetch(`${this.base}light?after=${this.#number}`, { signal: this.#stop.signal });
                if (answer.status === 403) return this.#lose("the server was started anew with another address");
                if (answer.status === 200) {
                    const container = readContainer(await answer.arrayBuffer());
                    // A restarted server may have another scene, or the same with other cells.
                    if (container.header.id !== this.id) return location.reload();
                    this.#number = Number(answer.headers.get("X-Number"));
                    this.listener.onLight(container);
                }
                this.#lost = false;
            } catch (error) {
                if (this.#closed) return;
                if (!(error instanceof TypeError)) console.error(error);
                this.#lose();
                // Whoever answers next may be another process.
                this.#number = 0;
                await pause(RETRY);
            }
        }
    }

    async #watch() {
        while (!this.#closed) {
            // A finished solve changes only if the server does.
            const rests = this.#last?.state === "finished" || document.hidden;
            if (!this.#lost) await this.#status().catch(() => this.#lose());
            await pause(rests ? 4 * STATUS_INTERVAL : STATUS_INTERVAL);
        }
    }

    async #status() {
        const answer = await fetch(this.base + "status", { signal: this.#stop.signal });
        if (!answer.ok) return;
        const status = await answer.json();
        if (!status?.state) return;
        status.error ??= NaN;
        if (JSON.stringify(status) !== JSON.stringify(this.#last)) this.listener.onStatus(status);
        this.#last = status;
    }

    /** @param {string} [message] */
    #lose(message) {
        if (this.#closed || (this.#lost && !message)) return;
        this.#lost = true;
        const last = this.#last ?? { rays: 0, rate: 0, error: NaN, seconds: 0, goal: null };
        this.#last = { ...last, state: "lost", message };
        this.listener.onStatus(this.#last);
    }
}

/** Until somebody looks: the server keeps what is newest. */
function shown() {
    if (!document.hidden) return Promise.resolve();
    return new Promise((done) => document.addEventListener("visibilitychange", done, { once: true }));
}

/** @param {number} milliseconds */
function pause(milliseconds) {
    return new Promise((done) => setTimeout(done, milliseconds));
}
