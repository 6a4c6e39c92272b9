#include "ply_stream.h"

#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"

#include <algorithm>
#include <cstring>
#include <future>
#include <vector>

namespace pbm::sample {

namespace {

constexpr std::uint64_t kBlock = 4096; // points

std::string header(const PointScan &scan, const PointPlyOptions &options) {
    return "ply\nformat " + std::string(format_name(options.encoding)) + " 1.0\ncomment " + options.comment +
           "\nelement vertex " + std::to_string(scan.points) +
           "\nproperty float x\nproperty float y\nproperty float z\n" +
           (options.normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "") +
           "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
}

void encode_binary(std::span<const ScanPoint> points, bool normals, Bytes &out) {
    out.resize(points.size() * (normals ? 27 : 15));
    std::uint8_t *at = out.data();
    const auto put = [&at](const auto &values) { // little-endian, as they lie in memory
        std::memcpy(at, &values, sizeof values);
        at += sizeof values;
    };
    for (const ScanPoint &point : points) {
        put(point.position);
        if (normals)
            put(point.normal);
        put(point.color);
    }
}

void encode_ascii(std::span<const ScanPoint> points, bool normals, Bytes &out) {
    out.clear();
    for (const ScanPoint &point : points) {
        for (const float value : point.position)
            put_text(out, value);
        if (normals)
            for (const float value : point.normal)
                put_text(out, value);
        for (const std::uint8_t value : point.color)
            put_text(out, unsigned{value});
        out.back() = '\n';
    }
}

// A block on its way: made by a worker, then written.
struct Block {
    std::vector<ScanPoint> points;
    Bytes bytes;
    std::future<void> made;
};

} // namespace

Status stream_ply(const PointScan &scan, const PointPlyOptions &options, const std::function<Status(ByteView)> &write) {
    const std::string head = header(scan, options);
    if (Status status = write(as_bytes(head)); !status)
        return status;

    const int threads = resolve_threads(options.threads);
    std::vector<Block> ring(static_cast<std::size_t>(threads) + 2);
    ThreadPool pool(threads == 1 ? 1 : threads + 1); // the calling thread only writes; destroyed before `ring`
    const std::uint64_t blocks = (scan.points + kBlock - 1) / kBlock;
    const auto begin = [&](std::uint64_t number) {
        Block &block = ring[number % ring.size()];
        block.made = pool.post([&scan, &options, &block, number] {
            const std::uint64_t first = number * kBlock;
            block.points.resize(std::min(kBlock, scan.points - first));
            scan.fill(first, block.points);
            if (options.encoding == PlyEncoding::ascii)
                encode_ascii(block.points, options.normals, block.bytes);
            else
                encode_binary(block.points, options.normals, block.bytes);
        });
    };
    std::uint64_t begun = 0;
    for (std::uint64_t number = 0; number < blocks; ++number) {
        for (; begun < blocks && begun < number + ring.size(); ++begun)
            begin(begun);
        Block &block = ring[number % ring.size()];
        block.made.get();
        if (Status status = write(block.bytes); !status)
            return status;
    }
    return {};
}

} // namespace pbm::sample
