// Pieces that `verify` tests together, and the layouts of what is computed for them; the views of a run that
// are summed for them (verify_field.cl). Passed by value from host/verify/verify_field.cpp.
#ifndef VDVR_VERIFY_PIECES_H
#define VDVR_VERIFY_PIECES_H

typedef struct {
  int count;             // pieces
  int rate;              // gold cells to a cell of the grid
  int cells;             // gold cells of a piece along an axis
  int nx, ny, z_padded;  // nodes of a block of the field, halo included
  int error_padded;      // nodes of a column of errors
  int words;             // of flags to a column of cells
  int z_first, z_last;   // cells of a block that meet the covered heights
  int windowed;          // whether cells outside the window do not count
  float window_low, window_high;
  float correction;  // of second differences by fourth ones
} VdvrPieces;

// 40 bytes.
typedef struct {
  int accumulate;         // whether the run is added to what the field holds, or written
  int first_view;         // of the run, of all views
  int in_table;           // the same of the table's
  int views, all_views;   // of the run; of the scan
  int columns, z_padded;  // of the table: fine columns, and nodes along z to a multiple of 16
  int nx, ny;             // nodes of a block of the field, halo included
  int blocks;
} VdvrViewRun;

#endif
