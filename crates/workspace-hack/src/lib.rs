//! No code: the manifest asks shared packages for the features of the whole workspace.
