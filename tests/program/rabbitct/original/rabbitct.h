/* The data of RabbitCT's original interface, as its modules expect them. A stand-in for the test of
 * bench/peers/fdk. */
#ifndef RABBITCT_STAND_IN_H
#define RABBITCT_STAND_IN_H

struct RabbitCtGlobalData {
  unsigned int L, S_x, S_y; /* samples along an axis, columns, rows */
  double* A_n;              /* 3x4, column by column */
  float* I_n;               /* [row][column] */
  float R_L, O_L;           /* distance of samples, place of the first */
  float* f_L;               /* [z][y][x]; a module may put its own here */
  unsigned int adv_numProjBuffers;
  float** adv_pProjBuffers;
  unsigned int adv_N, adv_projNumber;
  double** adv_ppProjMatrixBuffers;
  unsigned int adv_numAvailProjs, adv_firstProjOfSubset;
};

#endif
