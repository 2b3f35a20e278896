//! Certified TEL.

mod cells;
