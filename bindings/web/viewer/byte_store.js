// Bytes of one file that are here: spans that do not overlap, in the order of the file. The store notes the ranges that
// it was asked for and lacks, and frees the spans that were used longest ago.

export class ByteStore {
    #spans = []; // {from, to, bytes, used}, ascending
    #lacking = []; // [from, to] that read() lacked since takeLacking(), most urgent first
    #clock = 0;
    #held = 0;

    // `budget`: bytes that trim() leaves.
    constructor(budget = Infinity) {
        this.budget = budget;
    }

    get held() {
        return this.#held;
    }

    // Index of the first span that ends behind `offset`.
    #find(offset) {
        let low = 0;
        let high = this.#spans.length;
        while (low < high) {
            const middle = (low + high) >> 1;
            if (this.#spans[middle].to > offset) high = middle;
            else low = middle + 1;
        }
        return low;
    }

    // Parts of [from, to) that are not here, as [from, to].
    missing(from, to) {
        const gaps = [];
        let at = from;
        for (let i = this.#find(from); at < to && i < this.#spans.length && this.#spans[i].from < to; ++i) {
            if (this.#spans[i].from > at) gaps.push([at, this.#spans[i].from]);
            at = this.#spans[i].to;
        }
        if (at < to) gaps.push([at, to]);
        return gaps;
    }

    // Takes ownership of `bytes`, which begin at `offset`. What is here already stays.
    put(offset, bytes) {
        for (const [from, to] of this.missing(offset, offset + bytes.length)) {
            const part = bytes.subarray(from - offset, to - offset);
            // A part shares the memory of the whole: a small one is copied, so that the whole can be freed.
            const own = part.length * 2 < bytes.buffer.byteLength ? part.slice() : part;
            this.#spans.splice(this.#find(from), 0, { from, to, bytes: own, used: ++this.#clock });
            this.#held += own.length;
        }
    }

    // The bytes, or null and a note of what is missing. What is returned must not be changed.
    read(offset, size) {
        const end = offset + size;
        const gaps = this.missing(offset, end);
        if (gaps.length > 0) {
            this.#lacking.push(...gaps);
            return null;
        }
        let i = this.#find(offset);
        const first = this.#spans[i];
        if (first && first.to >= end) {
            first.used = ++this.#clock;
            return first.bytes.subarray(offset - first.from, end - first.from);
        }
        const joined = new Uint8Array(size);
        for (; i < this.#spans.length && this.#spans[i].from < end; ++i) {
            const span = this.#spans[i];
            span.used = ++this.#clock;
            const from = Math.max(span.from, offset);
            joined.set(span.bytes.subarray(from - span.from, Math.min(span.to, end) - span.from), from - offset);
        }
        return joined;
    }

    clear() {
        this.#spans = [];
        this.#held = 0;
    }

    // Ranges that read() lacked since the last call, most urgent first.
    takeLacking() {
        const lacking = this.#lacking;
        this.#lacking = [];
        return lacking;
    }

    // Whether read() lacked a byte at or behind `end`.
    lacksBehind(end) {
        return this.#lacking.some(([, to]) => to > end);
    }

    // Frees spans until the budget holds, those first that were used longest ago.
    trim() {
        if (this.#held <= this.budget) return;
        for (const span of [...this.#spans].sort((a, b) => a.used - b.used)) {
            if (this.#held <= this.budget) break;
            span.bytes = null;
            this.#held -= span.to - span.from;
        }
        this.#spans = this.#spans.filter((span) => span.bytes !== null);
    }
}
