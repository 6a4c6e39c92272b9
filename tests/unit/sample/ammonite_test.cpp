#include "pbm-sample/ammonite/ammonite.h"
#include "pbm-sample/ply/ply_writer.h"

#include "pbm_format/hashes/hash.h"

#include <gtest/gtest.h>

#include <map>

namespace pbm::sample {
namespace {

TriangleMesh make(std::uint64_t vertices, int threads) {
    AmmoniteOptions options;
    options.vertices = vertices;
    options.threads = threads;
    return make_ammonite(options);
}

const TriangleMesh &small() {
    static const TriangleMesh mesh = make(kMinVertices, 2);
    return mesh;
}

// The same for every compiler and machine.
TEST(Ammonite, HasItsGoldenBytes) {
    EXPECT_EQ(hash64(encode_ply(small(), PlyEncoding::binary_little_endian, "golden")), 15229254765651686041U);
}

TEST(Ammonite, DoesNotDependOnTheNumberOfThreads) {
    const TriangleMesh one = make(kMinVertices, 1);
    EXPECT_EQ(one.position, small().position);
    EXPECT_EQ(one.color, small().color);
    EXPECT_EQ(one.triangle, small().triangle);
}

TEST(Ammonite, HasTheNumberOfVerticesAskedForWithinFivePercent) {
    for (const std::uint64_t wanted : {std::uint64_t{10000}, std::uint64_t{40000}}) {
        const auto vertices = static_cast<double>(make(wanted, 2).position.size());
        EXPECT_NEAR(vertices, static_cast<double>(wanted), 0.05 * static_cast<double>(wanted));
    }
}

TEST(Ammonite, IsOneClosedSurface) {
    // Every edge belongs to two triangles that run along it in opposite directions.
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto &t : small().triangle)
        for (std::size_t i = 0; i < 3; ++i)
            ++edges[{t[i], t[(i + 1) % 3]}];
    for (const auto &[edge, count] : edges) {
        ASSERT_EQ(count, 1);
        const auto opposite = edges.find({edge.second, edge.first});
        ASSERT_TRUE(opposite != edges.end());
    }
}

} // namespace
} // namespace pbm::sample
