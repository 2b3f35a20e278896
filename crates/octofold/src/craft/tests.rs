//! What crafting promises.
