// What JavaScript does for WebAssembly: reading and reporting, which pbm.js hands to each module, and numbers.cpp.
mergeInto(LibraryManager.library, {
    pbm_web_read__sig: "iijji",
    pbm_web_read: function (context, offset, size, to) {
        return Module["pbmRead"](context, offset, size, to);
    },
    pbm_web_report__sig: "iii",
    pbm_web_report: function (context, finding) {
        return Module["pbmReport"](context, finding);
    },
    pbm_web_power__sig: "ddd",
    pbm_web_power: function (base, exponent) {
        return Math.pow(base, exponent);
    },
    pbm_web_logarithm__sig: "dd",
    pbm_web_logarithm: function (number) {
        return Math.log(number);
    },
    pbm_web_number__sig: "dii",
    pbm_web_number: function (text, length) {
        var digits = "";
        while (HEAPU8[text + digits.length]) digits += String.fromCharCode(HEAPU8[text + digits.length]);
        HEAP32[length >> 2] = digits.length;
        return Number(digits);
    },
});
