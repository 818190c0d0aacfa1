/* The data of RabbitCT's later interface (NHR@FAU), as its modules expect them. A stand-in for the test of
   bench/peers/fdk. */
#ifndef RABBITCT_LATER_STAND_IN_H
#define RABBITCT_LATER_STAND_IN_H
#include <stdint.h>

typedef struct {
  int id;
  double* matrix; /* 3x4, column by column */
  float* image;   /* [row][column] */
} Projection;

typedef struct {
  uint32_t problemSize, imageWidth, imageHeight;
  float voxelSize, O_Index;
  float* volumeData; /* [z][y][x] */
  uint32_t numberOfProjections;
  double* globalGeometry;
  Projection* projectionBuffer;
  char* clipFilename;
} RabbitCtGlobalData;

#endif
