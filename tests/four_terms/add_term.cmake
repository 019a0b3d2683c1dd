# Copies INPUT (common/energy/bending.hpp) to OUTPUT with one more entry at the end of the list of terms.
file(READ ${INPUT} text)
string(FIND "${text}" "bending_terms =" begin)
string(SUBSTRING "${text}" ${begin} -1 rest)
string(FIND "${rest}" "});" end) # of the list: within it, lambdas end in "; }"
if(begin EQUAL -1 OR end EQUAL -1)
  message(FATAL_ERROR "${INPUT} has no list `bending_terms = ...});` any more")
endif()
math(EXPR cut "${begin} + ${end} + 1")
string(SUBSTRING "${text}" 0 ${cut} before)
string(SUBSTRING "${text}" ${cut} -1 after)
file(WRITE ${OUTPUT} "${before},
    BendingTerm{\"22\", \"k22\", \"k_{22}H^2K\",
                [](auto H, auto K, double) { return H * H * K; },
                [](auto H, auto K, double) { return H * H * H * H + K * K; }}${after}")
