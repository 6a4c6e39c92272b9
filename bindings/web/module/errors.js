// Errors as values of JavaScript.

/** Codes of PbmError. */
export const CODES = Object.freeze({
    OK: 0,
    USAGE: 1,
    IO: 2,
    INVALID: 3,
    LIMIT: 4,
    UNSUPPORTED: 5,
    CANCELLED: 6,
    PENDING: 7,
});
/** What went wrong: see pbm.d.ts. */
export class PbmError extends Error {
    constructor({ code, offset = null, name = "", rule = "", message }) {
        super(message);
        this.code = code;
        this.offset = offset;
        this.name = name;
        this.rule = rule;
    }
}

export function usage(message) {
    return new PbmError({ code: CODES.USAGE, message });
}
