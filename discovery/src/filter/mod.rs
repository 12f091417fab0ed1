//! The filter: trajectories, the model linearised along them, a Kalman filter and smoother on that, and whitening.

pub(crate) mod error;
pub(crate) mod estimate;
pub(crate) mod first;
pub(crate) mod kalman;
pub(crate) mod path;
pub(crate) mod prior;
pub(crate) mod sensor_slopes;
pub(crate) mod shelf;
pub(crate) mod variation;
pub(crate) mod vector;
pub(crate) mod whiten;
pub(crate) mod within;
