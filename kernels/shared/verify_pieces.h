// Pieces that `verify` tests together, and the layouts of what is computed for them (verify_pieces.cl).
// Passed by value from host/verify/verify_pieces.cpp.
#ifndef VDVR_VERIFY_PIECES_H
#define VDVR_VERIFY_PIECES_H

typedef struct {
  int count;              // pieces
  int rate;               // gold cells to a cell of the grid
  int cells;              // gold cells of a piece along an axis
  int nx, ny, z_padded;   // nodes of a block of the field, halo included
  int error_padded;       // nodes of a column of errors
  int words;              // of flags to a column of cells
  int z_first, z_last;    // cells of a block that meet the covered heights
  int in_first, in_last;  // and those whose corners are at covered heights
  int windowed;           // whether cells outside the window do not count
  float window_low, window_high;
  float correction;  // of second differences by fourth ones
  int each;          // nodes of a column that a work-item of verify_errors does
} VdvrPieces;

#endif
