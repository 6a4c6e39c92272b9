// The same scan for <model-viewer>: make_glb.mjs MESH.ply FOLDER writes draco.glb and meshopt.glb, as gltf-transform
// compresses them by default. Binary little-endian PLY files of triangles with float coordinates.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { Document, NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { draco, meshopt } from "@gltf-transform/functions";
import draco3d from "draco3dgltf";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";

const SIZES = { char: 1, uchar: 1, int8: 1, uint8: 1, short: 2, ushort: 2, int16: 2, uint16: 2, int: 4, uint: 4, int32: 4,
    uint32: 4, float: 4, float32: 4, double: 8, float64: 8 };

function readPly(name) {
    const file = readFileSync(name);
    const end = file.indexOf("end_header\n") + "end_header\n".length;
    const header = file.subarray(0, end).toString("latin1").split("\n").map((line) => line.trim().split(/\s+/));
    if (!header.some(([word, format]) => word === "format" && format === "binary_little_endian"))
        throw new Error(`${name}: not a binary little-endian PLY file`);
    const elements = [];
    for (const [word, ...rest] of header) {
        if (word === "element") elements.push({ name: rest[0], count: +rest[1], properties: [] });
        if (word === "property") elements.at(-1).properties.push(rest);
    }
    const vertices = elements.find((element) => element.name === "vertex");
    const faces = elements.find((element) => element.name === "face");
    const stride = vertices.properties.reduce((sum, [type]) => sum + SIZES[type], 0);
    const positions = new Float32Array(3 * vertices.count);
    for (let v = 0; v < vertices.count; ++v)
        for (let axis = 0; axis < 3; ++axis) positions[3 * v + axis] = file.readFloatLE(end + v * stride + 4 * axis);
    const indices = new Uint32Array(3 * faces.count);
    const [, countType] = faces.properties[0];
    for (let f = 0, at = end + stride * vertices.count; f < faces.count; ++f) {
        const count = SIZES[countType] === 1 ? file[at] : file.readUInt32LE(at);
        if (count !== 3) throw new Error(`${name}: face ${f} is no triangle`);
        for (let i = 0; i < 3; ++i) indices[3 * f + i] = file.readUInt32LE(at + SIZES[countType] + 4 * i);
        at += SIZES[countType] + 12;
    }
    return { positions, indices };
}

// Of the vertices: means of their triangles' by area.
function normalsOf(positions, indices) {
    const normals = new Float32Array(positions.length);
    for (let at = 0; at < indices.length; at += 3) {
        const [a, b, c] = [0, 1, 2].map((i) => positions.subarray(3 * indices[at + i], 3 * indices[at + i] + 3));
        const u = [0, 1, 2].map((i) => b[i] - a[i]);
        const v = [0, 1, 2].map((i) => c[i] - a[i]);
        const cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for (let corner = 0; corner < 3; ++corner)
            for (let i = 0; i < 3; ++i) normals[3 * indices[at + corner] + i] += cross[i];
    }
    for (let at = 0; at < normals.length; at += 3) {
        const length = Math.hypot(...normals.subarray(at, at + 3)) || 1;
        for (let i = 0; i < 3; ++i) normals[at + i] /= length;
    }
    return normals;
}

const [input, folder] = process.argv.slice(2);
const { positions, indices } = readPly(input);
const normals = normalsOf(positions, indices);
await Promise.all([MeshoptEncoder.ready, MeshoptDecoder.ready]);
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
    "draco3d.encoder": await draco3d.createEncoderModule(), "draco3d.decoder": await draco3d.createDecoderModule(),
    "meshopt.encoder": MeshoptEncoder, "meshopt.decoder": MeshoptDecoder });
for (const [name, compress] of [["draco", draco()], ["meshopt", meshopt({ encoder: MeshoptEncoder })]]) {
    const document = new Document();
    const buffer = document.createBuffer();
    const primitive = document.createPrimitive()
        .setAttribute("POSITION", document.createAccessor().setType("VEC3").setArray(positions).setBuffer(buffer))
        .setAttribute("NORMAL", document.createAccessor().setType("VEC3").setArray(normals).setBuffer(buffer))
        .setIndices(document.createAccessor().setType("SCALAR").setArray(indices).setBuffer(buffer))
        .setMaterial(document.createMaterial().setBaseColorFactor([0.5, 0.5, 0.5, 1]).setRoughnessFactor(1).setMetallicFactor(0));
    document.createScene().addChild(document.createNode().setMesh(document.createMesh().addPrimitive(primitive)));
    await document.transform(compress);
    await io.write(join(folder, `${name}.glb`), document);
}
