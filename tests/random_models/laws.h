// Laws for every file, valid or damaged.
#pragma once

#include "pbm_format/model/model.h"

#include <string>

namespace pbm::test {

struct Judgement {
    bool valid = false; // the verdict, if `verify` and `validate` agree
    std::string broken; // the violated law and how; empty: none
};

// `verify` and `validate` give the same verdict, findings lie inside the file, and a file that they
// call valid loads and can be drawn.
Judgement judge(ByteView file);

// The same for a file that must be valid, contain `model`, and keep its content_id when encoded again.
Judgement judge_valid(ByteView file, const Model &model);

} // namespace pbm::test
