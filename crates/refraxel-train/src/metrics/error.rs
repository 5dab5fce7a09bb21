//! Why images cannot be compared.

/// The two images of one comparison do not match.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricsError {
    /// Render and truth differ in size.
    #[error("the render is {}x{} but the truth is {}x{} pixels: render the truth's camera at full size",
        render.0, render.1, truth.0, truth.1)]
    ImageSize {
        /// Width and height of the render [pixel].
        render: (usize, usize),
        /// Width and height of the truth [pixel].
        truth: (usize, usize),
    },
    /// The mask has another number of pixels than the truth.
    #[error("the mask has {mask} pixels but the image has {image}: a mask has the size of its image")]
    MaskSize {
        /// Pixels of the mask.
        mask: usize,
        /// Pixels of the image.
        image: usize,
    },
}
