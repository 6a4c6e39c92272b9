// Properties that mirror attributes: frameworks set those rather than attributes. The attribute of `autoRotate` is
// `auto-rotate`.

// By name: what its values are. Texts and numbers are null where the element lacks the attribute; null and undefined
// remove it.
export const PROPERTIES = {
    src: String,
    alt: String,
    poster: String,
    quality: String,
    backs: String,
    cameraOrbit: String,
    cameraTarget: String,
    fieldOfView: String,
    background: String,
    shading: String,
    lightFollows: String,
    headlight: String,
    colourBy: String,
    dropClass: String,
    showClass: String,
    loading: String,
    reveal: String,
    touchAction: String,
    maxMemory: Number,
    autoRotate: Boolean,
    controls: Boolean,
    disableZoom: Boolean,
    noLegend: Boolean,
};

// Gives a class of elements the properties.
export function defineProperties(prototype) {
    for (const [name, type] of Object.entries(PROPERTIES)) {
        const attribute = name.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`);
        Object.defineProperty(prototype, name, {
            configurable: true,
            enumerable: true,
            get() {
                if (type === Boolean) return this.hasAttribute(attribute);
                const text = this.getAttribute(attribute);
                return text === null ? null : type(text);
            },
            set(value) {
                if (type === Boolean) this.toggleAttribute(attribute, Boolean(value));
                else if (value === null || value === undefined) this.removeAttribute(attribute);
                else this.setAttribute(attribute, value);
            },
        });
    }
}

// A page may have set properties before the code of its element was there: they would hide those of the class.
export function adoptProperties(element) {
    for (const name of Object.keys(PROPERTIES)) {
        if (!Object.hasOwn(element, name)) continue;
        const value = element[name];
        delete element[name];
        element[name] = value;
    }
}
