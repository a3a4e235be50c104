"""What files of tables hold: columns of text and numbers, block by block, however they are written."""
