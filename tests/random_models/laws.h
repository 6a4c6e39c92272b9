// What holds of every file, valid or damaged.
#pragma once

#include "pbm_format/model/model.h"

#include <string>

namespace pbm::test {

struct Judgement {
    bool valid = false; // what `verify` and `validate` say, if they agree
    std::string broken; // the law that is broken, and how; empty: none
};

// `verify` and `validate` give the same verdict, findings lie inside the file, and a file that they
// call valid loads and can be drawn.
Judgement judge(ByteView file);

// The same of a file that must be valid, hold `model` and, encoded anew, keep its content_id.
Judgement judge_valid(ByteView file, const Model &model);

} // namespace pbm::test
