// The same without the weight of FDK: what the comparison must catch.
#define STAND_IN_WEIGHT(w) (1 + 0 * (w))
#include "Bilinear.cpp"
