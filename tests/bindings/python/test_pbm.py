"""The Python package, on the library that PBM_LIBRARY names or that a wheel holds."""

import copy
import errno
import gc
import json
import os
import pathlib
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

try:
    import numpy as np
except ImportError:
    print("numpy is not installed (python3-numpy): skipped")
    sys.exit(77)
import pbm


def ball(rings=24, sectors=48):
    """Vertices and faces of a ball around (10, 20, 30)."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(sectors) * 2 * np.pi / sectors, indexing="ij")
    normals = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)], -1).reshape(-1, 3)
    ring, sector = np.meshgrid(np.arange(rings), np.arange(sectors), indexing="ij")
    a, b = ring * sectors + sector, ring * sectors + (sector + 1) % sectors
    faces = np.concatenate([np.stack([a, b, a + sectors], -1), np.stack([b, b + sectors, a + sectors], -1)])
    return normals + [10, 20, 30], faces.reshape(-1, 3), normals


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.path = cls.folder / "ball.pbvg"
        cls.vertices, cls.faces, cls.normals = ball()
        cls.heights = cls.normals[:, 1].copy()
        cls.heights[0] = np.nan
        cls.report = pbm.build(cls.vertices, cls.faces, normals=cls.normals, fields={"height": cls.heights},
                               units={"height": "mm"}, colours=np.full((len(cls.vertices), 3), (200, 100, 50)), depth=6,
                               unit="mm", output=cls.path)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()


class Reading(Case):
    def test_info(self):
        with pbm.open(self.path) as model:
            info = model.info
            self.assertEqual((info.depth, info.unit, info.materials, info.lights), (6, "mm", 1, 0))
            self.assertEqual(info.points, self.report.figures["points"])
            self.assertEqual(info.attributes, {"colours", "closed"})
            self.assertEqual([(f.name, f.unit, f.average) for f in info.fields], [("height", "mm", "mean")])
            self.assertTrue(np.allclose((info.lowest + info.highest) / 2, [10, 20, 30], atol=0.1))
            self.assertIsInstance(info.metadata, dict)
            self.assertIn("points=", repr(model))

    def test_points_of_every_level(self):
        with pbm.open(self.path.read_bytes()) as model:
            for level in range(model.info.depth + 1):
                points = model.points(level)
                self.assertEqual(set(points), {"positions", "normals", "radii", "colours", "scalar_height"})
                count = model.count_points(level)
                self.assertTrue(all(len(array) == count for array in points.values()))
            self.assertEqual(count, model.info.points)
            edge = model.info.voxel_size
            self.assertTrue(np.allclose(np.linalg.norm(points["positions"] - [10, 20, 30], axis=1), 1, atol=edge))
            self.assertTrue(np.allclose(np.linalg.norm(points["normals"], axis=1), 1, atol=1e-6))
            self.assertTrue((points["colours"] == (200, 100, 50)).all())
            self.assertTrue(np.allclose(points["scalar_height"], points["positions"][:, 1] - 20, atol=edge))

    def test_both_sides_of_a_thin_wall(self):
        corners = np.array([[x, y, z + 0.3 * x] for z in (0.001, 0) for x in (0, 1) for y in (0, 1)], float)
        colours = np.repeat([[200, 40, 40], [40, 40, 200]], 4, axis=0)
        pbm.build(corners, [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6]], colours=colours, depth=6,
                  output=self.folder / "wall.pbvg")
        with pbm.open(self.folder / "wall.pbvg") as model:
            self.assertIn("sides", model.info.attributes)
            sides = model.sides()
            self.assertEqual(set(sides), {"points", "normals", "colours"})
            self.assertGreater(len(sides["points"]), 3000)
            self.assertTrue((np.diff(sides["points"].astype(int)) > 0).all())
            upper = sides["normals"][..., 2] > 0
            self.assertTrue((upper.sum(axis=1) == 1).all())
            self.assertTrue((sides["colours"][upper] == (200, 40, 40)).all())
            self.assertTrue((sides["colours"][~upper] == (40, 40, 200)).all())
        with pbm.open(self.path) as model:
            self.assertEqual([len(array) for array in model.sides(3).values()], [0, 0, 0])

    def test_wanted_attributes_types_and_arrays(self):
        with pbm.open(self.path) as model:
            whole = model.points()
            count = model.info.points
            out = {"positions": np.full((count, 3), 7, np.float32), "two_sided": np.ones(count, bool)}
            some = model.points(attributes=["positions", "two_sided", "materials"], dtype=np.float32, offset=(10, 20, 30),
                                out=out, threads=1)
            self.assertEqual(list(some), ["positions", "two_sided", "materials"])
            self.assertIs(some["positions"], out["positions"])
            self.assertTrue((some["positions"] == (whole["positions"] - [10, 20, 30]).astype(np.float32)).all())
            self.assertFalse(some["two_sided"].any())
            for wrong in (np.empty((count, 3)), np.empty((count - 1, 3), np.float32), np.empty((3, count), np.float32).T):
                with self.assertRaises(pbm.UsageError):
                    model.points(attributes=["positions"], dtype=np.float32, out={"positions": wrong})
            for arguments in ({"level": 7}, {"level": -1}, {"attributes": ["weight"]}, {"dtype": np.int32},
                              {"threads": -1}, {"out": {"position": whole["positions"]}},
                              {"attributes": ["radii"], "out": {"positions": whole["positions"]}}):
                with self.assertRaises(pbm.UsageError, msg=arguments):
                    model.points(**arguments)

    def test_ranges(self):
        stored, sent = self.path.read_bytes(), []

        def read(offset, count):
            sent.append(count)
            return stored[offset:offset + count]

        with pbm.open_ranges(read, len(stored)) as model, pbm.open(stored) as whole:
            self.assertLess(sum(sent), len(stored) // 2)
            self.assertTrue((model.render(size=(40, 30)) == whole.render(size=(40, 30))).all())
            self.assertTrue((model.points()["scalar_height"] == whole.points()["scalar_height"]).all())

        def fail(offset, count):
            raise ConnectionError("the server is gone")

        with self.assertRaisesRegex(ConnectionError, "gone"):
            pbm.open_ranges(fail, len(stored))
        with self.assertRaisesRegex(ValueError, "0 bytes instead of"):
            pbm.open_ranges(lambda offset, count: b"", len(stored))

    def test_the_function_that_reads_may_not_close(self):
        stored = self.path.read_bytes()
        models = []

        def read(offset, count):
            if models:
                models[0].close()
            return stored[offset:offset + count]

        models.append(pbm.open_ranges(read, len(stored)))
        with self.assertRaisesRegex(pbm.UsageError, "must not close"):
            models[0].points()
        model, = models
        models.clear()
        self.assertEqual(len(model.points()["radii"]), model.info.points)
        model.close()

    def test_copies_do_not_close_the_original(self):
        with pbm.open(self.path) as model:
            for make in (copy.copy, copy.deepcopy, pickle.dumps):
                with self.assertRaisesRegex(TypeError, "open its file again"):
                    make(model)
            gc.collect()
            self.assertEqual(model.count_points(), model.info.points)

    def test_private_models_outlive_their_file(self):
        file = self.folder / "overwritten.pbvg"
        shutil.copy(self.path, file)
        with pbm.open(file, private=True) as model, pbm.open(self.path) as same:
            file.write_bytes(b"")
            self.assertTrue((model.points()["positions"] == same.points()["positions"]).all())
            self.assertTrue((model.render(size=(40, 30)) == same.render(size=(40, 30))).all())
        with self.assertRaises(pbm.InvalidError):
            pbm.open(file, private=True)
        os.mkfifo(self.folder / "pipe")
        for name, number in (("nowhere", errno.ENOENT), (".", errno.EISDIR), ("pipe", errno.EIO)):
            with self.assertRaises(pbm.FileError) as caught:
                pbm.open(self.folder / name, private=True)
            self.assertEqual(caught.exception.errno, number)

    def test_errors(self):
        nowhere = self.folder / "nowhere.pbvg"
        for call in (pbm.open, pbm.validate):
            with self.assertRaises(pbm.FileError) as caught:
                call(nowhere)
            error = caught.exception
            self.assertIsInstance(error, OSError)
            self.assertEqual((error.code, error.offset, error.errno, error.filename), (2, None, errno.ENOENT, str(nowhere)))
            self.assertEqual((str(error), error.strerror), (f"{nowhere}: cannot open: {os.strerror(errno.ENOENT)}",
                                                            os.strerror(errno.ENOENT)))
        for kind in (pbm.FileError("gone", None, "io.read", "", "x"), pbm.InvalidError("bad", 7, "a.b", "4.2")):
            again = pickle.loads(pickle.dumps(kind))
            self.assertEqual((type(again), str(again), again.__dict__), (type(kind), str(kind), kind.__dict__))
        with self.assertRaises(pbm.FileError) as caught:
            pbm.open(self.folder)
        self.assertEqual((caught.exception.errno, caught.exception.filename), (errno.EISDIR, str(self.folder)))
        with self.assertRaises(pbm.InvalidError) as caught:
            pbm.open(b"x" * 200)
        self.assertEqual((caught.exception.code, caught.exception.offset, caught.exception.name, caught.exception.rule),
                         (3, None, "header.magic", "2.1"))
        for wrong in (b"", bytearray(7), memoryview(b"abc")):
            with self.assertRaises(pbm.InvalidError):
                pbm.open(wrong)
        with self.assertRaises(TypeError):
            pbm.open(7)
        model = pbm.open(self.path)
        model.close()
        model.close()
        for call in (model.points, model.render, model.default_camera, lambda: model.info):
            with self.assertRaises(pbm.UsageError):
                call()

    def test_bytes_stay_alive(self):
        model = pbm.open(bytearray(self.path.read_bytes()))
        gc.collect()
        self.assertEqual(len(model.points()["radii"]), model.info.points)

    def test_threads(self):
        with pbm.open(self.path) as model:
            expected, found = model.points()["positions"], []
            threads = [threading.Thread(target=lambda: found.append(model.points()["positions"])) for _ in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(len(found), 4)
            self.assertTrue(all((positions == expected).all() for positions in found))


class Pictures(Case):
    def test_pictures(self):
        with pbm.open(self.path) as model:
            camera = model.default_camera((60, 40))
            for quality in ("fast", "fine"):
                for cue in (None, "eye_dome", "ambient_occlusion"):
                    picture, depth = model.render(camera, (60, 40), quality=quality, depth_cue=cue, depth=True, samples=2,
                                                  background=(1, 2, 3))
                    self.assertEqual((picture.shape, picture.dtype), ((40, 60, 4), np.uint8))
                    self.assertEqual(picture[0, 0].tolist(), [1, 2, 3, 255])
                    self.assertEqual(depth.shape, (40, 60))
                    self.assertAlmostEqual(np.isfinite(depth).mean(), np.pi / 4 * 40 / 60 * 0.9, delta=0.06)
            turned = model.render(camera.orbited(90), (60, 40))
            self.assertFalse((turned == model.render(camera, (60, 40), background=(0, 0, 0))).all())
            camera.clip_plane = ((10, 20, 30), (1, 0, 0))
            _, depth = model.render(camera, (60, 40), depth=True)
            self.assertFalse(np.isfinite(depth[:, :28]).any())

    def test_lights_follow_the_eye_or_the_model(self):
        with pbm.open(self.path) as model:
            behind = model.default_camera((60, 40)).orbited(180)
            usual, eye, fixed = (model.render(behind, (60, 40), light_follows=word) for word in (None, "eye", "model"))
            self.assertTrue((usual == eye).all())
            self.assertLess(fixed[..., :3].mean(), usual[..., :3].mean() - 5)

    def test_colours_of_a_field_and_a_headlight(self):
        with pbm.open(self.path) as model:
            camera = model.default_camera((60, 40))
            own, coloured, grey = (model.render(camera, (60, 40), **look) for look in (
                {}, {"colour_by": "height"}, {"colour_by": "height", "colour_map": "grey", "colour_range": (-0.5, 0.5)}))
            self.assertTrue((own[20, 30] != coloured[20, 30]).any())
            self.assertTrue((grey[..., 0] == grey[..., 2]).all())
            left, right = (model.render(camera, (60, 40), headlight=(angle, 0)).astype(int) for angle in (-60, 60))
            self.assertGreater(left[20, 22, 0], right[20, 22, 0] + 20)

    def test_orbit_keeps_the_distance(self):
        camera = pbm.Camera((3, 1, 0), (1, 1, 0))
        self.assertTrue(np.allclose(camera.orbited(90).position, (1, 1, -2)))

    def test_errors(self):
        with pbm.open(self.path) as model:
            for arguments in ({"quality": "best"}, {"depth_cue": "x"}, {"light_follows": "x"}, {"without": ["sky"]}, {"size": (0, 10)},
                              {"headlight": (0, 91)}, {"colour_by": "width"}, {"colour_map": "rainbow"},
                              {"colour_by": "height", "colour_range": (1, 0)},
                              {"size": (40000, 10)}, {"samples": 1000}, {"threads": -5},
                              {"camera": pbm.Camera((0, 0, float("nan")), (0, 0, 0))},
                              {"camera": pbm.Camera((0, 0), (0, 0, 0))}, {"camera": pbm.Camera((1, 1, 1), (1, 1, 1))}):
                with self.assertRaises(pbm.UsageError, msg=arguments):
                    model.render(**arguments)


class Validating(Case):
    def test_verdicts(self):
        stored = bytearray(self.path.read_bytes())
        for level in ("quick", "default", "deep"):
            findings = pbm.validate(self.path, level)
            self.assertTrue(findings.valid)
            self.assertEqual((findings.code, findings.errors), (0, 0))
        stored[len(stored) // 2] ^= 1
        findings = pbm.validate(stored)
        self.assertFalse(findings.valid)
        self.assertEqual(findings.code, 3)
        self.assertEqual(findings[0].severity, "error")
        self.assertIn(".", findings[0].name)
        self.assertGreater(findings[0].offset, 0)
        self.assertFalse(pbm.validate(b"").valid)
        with self.assertRaises(pbm.FileError):
            pbm.validate(self.folder / "nowhere")
        with self.assertRaises(pbm.UsageError):
            pbm.validate(self.path, "slow")


class Building(Case):
    def test_in_memory(self):
        report = pbm.build(self.vertices.astype(np.float32), depth=5, light=["directional,direction=0,-1,0"],
                           origin=(0, 0, 5), strict=True)
        with report.model as model:
            self.assertEqual((model.info.depth, model.info.lights), (5, 1))
            self.assertAlmostEqual((model.info.lowest + model.info.highest)[2] / 2, 35, delta=0.2)
        self.assertIn("attributes", report.figures)
        json.dumps(report.figures)

    def test_colours_and_edges_as_scans_have_them(self):
        cube = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        quads = ["0 1 3 2", "4 6 7 5", "0 4 5 1", "2 3 7 6", "0 2 6 4", "1 5 7 3"]
        paint = ["250 0 0", "0 250 0", "0 0 250", "250 250 0", "250 0 250", "0 250 250"]
        corners = "".join(f"{x} {y} {z}\n" for x, y, z in cube)

        def built(name, text, **options):
            (self.folder / name).write_text(text)
            return pbm.build(files=self.folder / name, depth=6, **options)

        # The faces of a cube have one colour each, and only edges have mixed ones.
        scans = [("cube.off", "OFF\n8 6 0\n" + corners + "".join(f"4 {q} {c}\n" for q, c in zip(quads, paint))),
                 ("cube.ply", "ply\nformat ascii 1.0\nelement vertex 8\n" +
                  "".join(f"property float {axis}\n" for axis in "xyz") +
                  "element face 6\nproperty list uchar int vertex_index\n" +
                  "".join(f"property double {c}\n" for c in ("red", "green", "blue")) + "end_header\n" + corners +
                  "".join(f"4 {q} {' '.join(str(int(n) / 255) for n in c.split())}\n" for q, c in zip(quads, paint)))]
        for name, text in scans:
            points = built(name, text).model.points()
            inside = np.sort(np.abs(points["positions"]), axis=1)[:, 1] < 0.9
            found = np.unique(points["colours"][inside], axis=0).tolist()
            self.assertEqual(found, sorted([int(n) for n in c.split()] for c in paint), name)
        # Smoothing groups of OBJ, and bytes as colours of its materials.
        (self.folder / "cube.mtl").write_text("newmtl a\nKd 200 100 30\n")
        faces = "".join("f " + " ".join(str(int(i) + 1) for i in q.split()) + "\n" for q in quads)
        obj = "mtllib cube.mtl\nusemtl a\n" + "".join(f"v {line}\n" for line in corners.splitlines())
        normals = {}
        for group in ("off", "1"):
            report = built("cube.obj", f"{obj}s {group}\n{faces}")
            normals[group] = len(np.unique(report.model.points()["normals"], axis=0))
            self.assertIn("their colours, in 0..255, to sRGB of 8 bits",
                          [line["note"] for line in report.figures["attributes"]])
        self.assertLess(normals["off"] + 50, normals["1"])
        # Columns without names, with numbers of the rows and decimal commas.
        rows = [f"{i};{x},5;{y},5;{z},5;200;100;30" for i, (x, y, z) in enumerate(cube * 2, 1)]
        with self.assertRaisesRegex(pbm.InvalidError, "guessed-columns"):
            built("rows.csv", "\n".join(rows) + "\n", deny="guessed-columns")
        model = built("rows.csv", "\n".join(rows) + "\n").model
        self.assertEqual(np.unique(model.points()["colours"], axis=0).tolist(), [[200, 100, 30]])
        self.assertLess(model.info.highest[0] - model.info.lowest[0], 3.1)

    def test_of_files(self):
        ply = self.folder / "points.ply"
        ply.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(self.vertices)}\nproperty float x\nproperty float y\n"
                       "property float z\nend_header\n" + "\n".join(" ".join(map(repr, row)) for row in self.vertices.tolist()))
        for files in (ply, str(ply), [ply, ply]):
            with pbm.build(files=files, depth=5).model as model:
                self.assertEqual(model.info.depth, 5)
        with self.assertRaises(pbm.FileError) as caught:
            pbm.build(files=[ply, "nowhere.ply"])
        self.assertEqual((caught.exception.errno, caught.exception.filename), (errno.ENOENT, "nowhere.ply"))

    def test_the_model_of_an_output_is_open(self):
        output = self.folder / "output.pbvg"
        report = pbm.build(self.vertices, depth=5, output=output)
        output.unlink()
        with report.model as model:
            self.assertEqual(model.info.points, report.figures["points"])

    def test_zero_bytes_are_refused(self):
        name = str(self.path) + "\0.pbvg"
        for call in (lambda: pbm.open(name), lambda: pbm.open(name, private=True), lambda: pbm.validate(name),
                     lambda: pbm.build(files=name), lambda: pbm.build(self.vertices, output=name),
                     lambda: pbm.build(self.vertices, panorama=name), lambda: pbm.build(self.vertices, **{"depth\0": 5}),
                     lambda: pbm.build(self.vertices, fields={"a\0": self.heights}),
                     lambda: pbm.build(self.vertices, fields={"a": self.heights}, units={"a": "m\0"})):
            with self.assertRaisesRegex(ValueError, "zero byte"):
                call()

    def test_signals_end_a_build(self):
        old, main = self.path.read_bytes(), threading.main_thread().ident

        class Interrupted(BaseException):
            pass

        def interrupt(_number, _frame):
            raise Interrupted

        def in_step(name):
            def progress(step, done):
                if step == name and done < 1:
                    signal.pthread_kill(main, signal.SIGUSR1)
            return progress

        before = signal.signal(signal.SIGUSR1, interrupt)
        try:
            for step in ("voxelize", "write"):
                with self.assertRaises(Interrupted, msg=step):
                    pbm.build(self.vertices, self.faces, depth=7, output=self.path, progress=in_step(step))
                self.assertEqual(self.path.read_bytes(), old)
            # Without `progress`, signals come from elsewhere, at any moment of one build after another. Python drops what is
            # raised while it deletes an object, so that one signal may be lost.
            ended = threading.Event()

            def send():
                while not ended.wait(0.2):
                    signal.pthread_kill(main, signal.SIGUSR1)

            sender = threading.Thread(target=send)
            sender.start()
            try:
                with self.assertRaises(Interrupted):
                    for _ in range(1000):
                        pbm.build(self.vertices, self.faces, depth=7)
            finally:
                signal.signal(signal.SIGUSR1, signal.SIG_IGN)
                ended.set()
                sender.join()
        finally:
            signal.signal(signal.SIGUSR1, before)

    def test_progress(self):
        steps = []
        pbm.build(self.vertices, depth=5, progress=lambda step, done: steps.append((step, done)))
        self.assertIn(("voxelize", 0.0), steps)
        old = self.path.read_bytes()
        with self.assertRaises(pbm.CancelledError):
            pbm.build(self.vertices, depth=5, output=self.path, progress=lambda step, done: step == "voxelize")
        with self.assertRaises(ZeroDivisionError):
            pbm.build(self.vertices, depth=5, output=self.path, progress=lambda step, done: 1 / 0)
        self.assertEqual(self.path.read_bytes(), old)

    def test_errors(self):
        good = self.vertices
        for arguments in ({"vertices": good[:, :2]}, {"vertices": "text"}, {"vertices": good, "files": "x"}, {},
                          {"vertices": good, "faces": [[0, 1, len(good)]]}, {"vertices": good, "faces": [[0, 1, -1]]},
                          {"vertices": good, "faces": [[0, 1, 0.5]]}, {"vertices": good, "colours": [[300, 0, 0]] * len(good)},
                          {"vertices": good, "normals": good[1:]}, {"vertices": good, "fields": {"a": [1, 2]}},
                          {"vertices": good, "depht": 5}, {"vertices": good, "depth": "many"},
                          {"vertices": good, "materials": [9] * len(good)}, {"vertices": np.empty((0, 3))}):
            with self.assertRaises(pbm.UsageError, msg=str(arguments)[:60]):
                pbm.build(**arguments)
        with self.assertRaises(pbm.FileError):
            pbm.build(good, depth=5, output=self.folder / "nowhere" / "x.pbvg")
        with self.assertRaises(pbm.InvalidError):
            pbm.build(np.full((5, 3), np.nan))


class Package(unittest.TestCase):
    def test_version(self):
        self.assertRegex(pbm.version(), r"^\d+\.\d+\.\d+$")
        self.assertEqual(pbm.__version__, pbm.version())
        with self.assertRaises(AttributeError):
            pbm.__author__

    def test_module_runs_programs(self):
        def run(*words):
            return subprocess.run([sys.executable, "-m", "pbm", *words], capture_output=True, text=True)

        self.assertEqual(run("--version").stdout.strip(), pbm.__version__)
        self.assertEqual((run("--help").returncode, run().returncode, run("destroy").returncode), (0, 1, 1))
        ran = run("info", "--help")
        self.assertIn("pbm-info", ran.stdout + ran.stderr)

    def test_import_takes_numpy_alone(self):
        program = "import sys, numpy; before = set(sys.modules); import pbm; print(*sorted(set(sys.modules) - before))"
        ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
        outside = [name for name in ran.stdout.split() if name.split(".")[0] not in sys.stdlib_module_names | {"pbm"}]
        self.assertEqual(outside, [])

    def test_everything_has_a_docstring(self):
        for name in pbm.__all__:
            self.assertTrue(getattr(pbm, name).__doc__, name)


if __name__ == "__main__":
    unittest.main()
