//! Small files of our own in the place of the original platform's, which are not ours to keep.
