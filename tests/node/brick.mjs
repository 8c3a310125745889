// Runs a main.py under MicroPython, with `pybricks` played by the process at the other end of stdin and stdout:
// each call goes out as a line of JSON, and the answer comes back as one.
import { readFileSync, readSync, readdirSync, writeSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { loadMicroPython } from "@micropython/micropython-webassembly-pyscript/micropython.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const chunk = Buffer.alloc(65536);
let unread = "";

function readLine() {
    while (!unread.includes("\n")) {
        const count = readSync(0, chunk);
        if (count === 0) {
            process.exit(3); // the other end is gone
        }
        unread += chunk.toString("utf8", 0, count);
    }
    const end = unread.indexOf("\n");
    const line = unread.slice(0, end);
    unread = unread.slice(end + 1);
    return line;
}

function call(text) {
    writeSync(1, text + "\n");
    return readLine();
}

const micropython = await loadMicroPython({
    heapsize: Number(process.argv[3]),
    stdout: (line) => call(JSON.stringify(["print", line])),
    linebuffer: true,
});
micropython.registerJsModule("bridge", { call });
micropython.FS.mkdir("/lib");
micropython.FS.mkdir("/lib/pybricks");
for (const name of readdirSync(join(here, "pybricks"))) {
    micropython.FS.writeFile("/lib/pybricks/" + name, readFileSync(join(here, "pybricks", name)));
}
let ending = ["end", null];
try {
    micropython.runPython("import sys\nsys.path.append('/lib')\n");
    micropython.runPython(readFileSync(process.argv[2], "utf8"));
} catch (error) {
    ending = ["end", String(error.message ?? error)];
}
writeSync(1, JSON.stringify(ending) + "\n");
process.exit(0);
