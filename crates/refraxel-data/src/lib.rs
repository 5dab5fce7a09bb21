//! Posed photographs: importers, images, masks, splits and what is wrong with them.
