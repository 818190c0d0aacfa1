#include "vdvr/expert/components.hpp"

namespace vdvr {

const char* text_of(Answer answer) {
  return answer == Answer::yes ? "yes" : answer == Answer::no ? "no" : "cannot tell";
}

Answer connected(const ComponentOfPoint& a, const ComponentOfPoint& b) {
  if (a.within == Answer::no || b.within == Answer::no || a.possible != b.possible) return Answer::no;
  return a.sure && a.sure == b.sure ? Answer::yes : Answer::maybe;
}

}  // namespace vdvr
