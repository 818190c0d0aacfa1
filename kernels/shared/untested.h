// The slack of a gold node that is not tested: compared as itself. Any other slack that is not >= 0 is a
// fault and counts as infinite, so that no NaN passes for "not tested". Read by node_slack.cl, cell_test.cl
// and host/certify/gold/gold_stream.hpp.
#ifndef VDVR_UNTESTED_H
#define VDVR_UNTESTED_H

#define VDVR_UNTESTED (-1e30f)

#endif
