// The structures of pbm.h as they lie in WebAssembly's memory.

import { CODES, PbmError, usage } from "./errors.js";

const LARGEST = 2 ** 32 - 1; // bytes that an address of 32 bits can count
const BYTES = { i32: 4, u32: 4, address: 4, u64: 8, f64: 8, u8: 1, text: 1 };

// A structure in C: "i32 code, text name 48, .." with members aligned to their size, and arrays with their length behind.
function structure(members) {
    let size = 0,
        alignment = 1;
    const places = members.split(",").map((member) => {
        const [type, name, count] = member.trim().split(" ");
        const bytes = BYTES[type];
        alignment = Math.max(alignment, bytes);
        const offset = Math.ceil(size / bytes) * bytes;
        size = offset + bytes * (count ?? 1);
        return { type, name, offset, count: count === undefined ? undefined : Number(count) };
    });
    return { places, size: Math.ceil(size / alignment) * alignment };
}

export const ERROR = structure("i32 code, u64 offset, text name 48, text rule 16, text message 512");
export const INFO = structure(
    "u32 structSize, u64 fileBytes, u64 points, i32 depth, u32 attributes, f64 origin 3, f64 voxelSize, f64 lowest 3, " +
        "f64 highest 3, address unit, address up, address metadata, text contentId 33, i32 fields, i32 materials, i32 lights",
);
export const CAMERA = structure(
    "u32 structSize, f64 position 3, f64 focalPoint 3, f64 up 3, f64 viewAngle, i32 orthographic, u32 clip, " +
        "f64 planePoint 3, f64 planeNormal 3, f64 boxLowest 3, f64 boxHighest 3, i32 backs",
);
export const OPTIONS = structure(
    "u32 structSize, i32 quality, i32 samples, i32 depthCue, u32 flags, u8 background 4, i32 finestLevel, f64 maxError, " +
        "i32 threads, u64 maxMemory, i32 lightFollows, f64 colourRange 2, f64 headlight 2, address colourBy, i32 colourMap, " +
        "address dropClass, address showClass, i32 shading, u8 backgroundBelow 4",
);
export const PICTURE = structure(
    "u32 structSize, i32 width, i32 height, address pixels, u32 pixelBytes, u32 stride, address depths, u32 depthCount, " +
        "u32 depthStride",
);
export const VALIDATION = structure(
    "u32 structSize, i32 level, i32 threads, u64 maxFindings, u32 report, u32 context, i32 verdict, u64 errors, " +
        "u64 warnings, u64 infos, u64 points",
);
export const FINDING = structure(
    "i32 severity, i32 code, u64 offset, address name, address rule, address section, address message, address remedy",
);

// The least and the largest whole number that a member may have.
const RANGES = {
    i32: [-(2 ** 31), 2 ** 31 - 1],
    u32: [0, 2 ** 32 - 1],
    address: [0, 2 ** 32 - 1],
    u64: [0, Number.MAX_SAFE_INTEGER],
};

const decoder = new TextDecoder(),
    encoder = new TextEncoder();

function isWithin(number, [least, largest]) {
    return Number.isInteger(number) && number >= least && number <= largest;
}

/** The memory of a module. Views of it end when it grows: they are made anew for each use. */
export class Memory {
    #memory;
    #malloc;

    constructor(memory, malloc) {
        this.#memory = memory;
        this.#malloc = malloc;
    }

    bytes(address, count) {
        return new Uint8Array(this.#memory.buffer, address, count);
    }
    get buffer() {
        return this.#memory.buffer;
    }
    get size() {
        return this.#memory.buffer.byteLength;
    }

    /** @returns {number} address of `count` bytes */
    allocate(count) {
        // malloc would take the number modulo 2^32.
        const address = count <= LARGEST ? this.#malloc(count) : 0;
        if (address === 0)
            throw new PbmError({
                code: CODES.LIMIT,
                name: "system.memory",
                message: `no memory left for ${count} bytes`,
            });
        return address >>> 0;
    }

    /** @returns {number} address of a copy of the text, which ends with a zero byte */
    allocateText(text) {
        const bytes = encoder.encode(`${text}\0`);
        const address = this.allocate(bytes.length);
        this.bytes(address, bytes.length).set(bytes);
        return address;
    }

    /** The text that ends with a zero byte. */
    text(address, limit = this.size - address) {
        const bytes = this.bytes(address, limit);
        return decoder.decode(bytes.slice(0, bytes.indexOf(0))); // shared memory cannot be decoded in place
    }

    #number(type, view, at) {
        switch (type) {
            case "i32":
                return view.getInt32(at, true);
            case "u64":
                return Number(view.getBigUint64(at, true));
            case "f64":
                return view.getFloat64(at, true);
            case "u8":
                return view.getUint8(at);
            default:
                return view.getUint32(at, true);
        }
    }

    /** Reads a structure; addresses are those of texts. */
    read({ places, size }, address) {
        const view = new DataView(this.#memory.buffer, address, size);
        const read = {};
        for (const { type, name, offset, count } of places)
            if (type === "text") read[name] = this.text(address + offset, count);
            else if (type === "address") read[name] = this.text(view.getUint32(offset, true));
            else if (count === undefined) read[name] = this.#number(type, view, offset);
            else
                read[name] = Array.from({ length: count }, (_, i) =>
                    this.#number(type, view, offset + BYTES[type] * i),
                );
        return read;
    }

    /** Writes a structure that begins with its size. Members that are not given are zero. */
    write({ places, size }, address, values) {
        this.bytes(address, size).fill(0);
        const view = new DataView(this.#memory.buffer, address, size);
        for (const { type, name, offset, count } of places) {
            const given = name === "structSize" ? size : values[name];
            if (given === undefined || given === null) continue;
            const numbers = count === undefined ? [given] : Array.from(given);
            if (numbers.length !== (count ?? 1)) throw usage(`${name} needs ${count} numbers`);
            numbers.forEach((number, i) => {
                const at = offset + BYTES[type] * i;
                if (typeof number !== "number") throw usage(`${name} needs numbers, not ${typeof number}`);
                if (type in RANGES && !isWithin(number, RANGES[type]))
                    throw usage(`${name} is ${number}, not a whole number, ${RANGES[type].join(" .. ")}`);
                switch (type) {
                    case "f64":
                        return view.setFloat64(at, number, true);
                    case "u64":
                        return view.setBigUint64(at, BigInt(number), true);
                    case "u8":
                        return view.setUint8(at, Math.min(255, Math.max(0, Math.round(number))));
                    default:
                        return view.setInt32(at, number, true);
                }
            });
        }
    }
}
