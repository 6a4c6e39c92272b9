// Light times 2^exposure, of all but the background, as pbm-render --exposure. Of fine pictures it is the light of whole
// pixels, not of their samples. A legend changes as the points do.

const linearOf = (srgb) => (srgb <= 0.04045 ? srgb / 12.92 : ((srgb + 0.055) / 1.055) ** 2.4);
const srgbOf = (linear) => (linear <= 0.0031308 ? linear * 12.92 : 1.055 * linear ** (1 / 2.4) - 0.055);
const byteOf = (linear) => Math.round(255 * srgbOf(Math.min(linear, 1)));

const LINEAR = Float64Array.from({ length: 256 }, (_, byte) => linearOf(byte / 255));

// `pixels`: RGBA, drawn without background; they are left as they are. Returns those of the picture in front of
// `background`, four bytes.
export function exposed(pixels, exposure, background) {
    const gain = 2 ** exposure;
    const graded = Uint8ClampedArray.from(LINEAR, (light) => byteOf(light * gain));
    const shown = new Uint8ClampedArray(pixels.length);
    const behind = background[3] / 255;
    for (let at = 0; at < pixels.length; at += 4) {
        if (pixels[at + 3] === 0) {
            shown.set(background, at);
            continue;
        }
        const share = pixels[at + 3] / 255;
        const rest = (1 - share) * behind;
        const alpha = share + rest;
        for (let c = 0; c < 3 && alpha > 0; c++) {
            const byte = graded[pixels[at + c]];
            shown[at + c] =
                rest > 0 ? byteOf((LINEAR[byte] * share + LINEAR[background[c]] * rest) / alpha) : byte;
        }
        shown[at + 3] = Math.round(255 * alpha);
    }
    return shown;
}
