// Law: for a file with edited fields and repaired hashes, reader and validator give the same verdict. A valid file
// loads, and every renderer draws it.
// Input: the first byte selects the file, the others the edits.
#include "fuzz/byte_source.h"
#include "random_models/damage.h"
#include "random_models/free_writer.h"
#include "random_models/laws.h"
#include "random_models/random_model.h"

#include <cstdio>
#include <cstdlib>

namespace {

using namespace pbm;

// Small files, so that most time is spent on damaged parts.
const std::vector<Bytes> &originals() {
    constexpr std::size_t kMaxBytes = 20000;
    static const std::vector<Bytes> all = [] {
        std::vector<Bytes> some;
        for (std::uint64_t seed = 1; some.size() < 64; ++seed) {
            test::Random random(seed);
            const Model model = test::random_model(random, 200);
            Bytes file = test::write_freely(model, random);
            if (file.size() <= kMaxBytes)
                some.push_back(std::move(file));
        }
        return some;
    }();
    return all;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size < 4)
        return 0;
    test::ByteSource input({data, size});
    const Bytes &original = originals()[input.next() % originals().size()];
    const test::Damaged damaged =
        test::damage(original, [&](std::uint64_t limit) { return input.below(static_cast<std::size_t>(limit)); });
    const test::Judgement judgement = test::judge(damaged.bytes);
    if (!judgement.broken.empty()) {
        std::fprintf(stderr, "%s (%s)\n", judgement.broken.c_str(), damaged.story.c_str());
        std::abort();
    }
    return 0;
}
