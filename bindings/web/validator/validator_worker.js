// The worker of the validator's page: reads one file and examines it.
import { loadValidator } from "../module/pbm.js";

self.onmessage = async ({ data: { file, ...options } }) => {
    try {
        const [validator, bytes] = await Promise.all([
            loadValidator(),
            file.arrayBuffer(),
        ]);
        self.postMessage({ report: validator.validate(new Uint8Array(bytes), options) });
    } catch (error) {
        self.postMessage({ message: error.message });
    }
};
self.postMessage("ready");
