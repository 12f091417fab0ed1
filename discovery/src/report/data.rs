//! What the report shows: plain data, filled by the discovery engine.
//!
//! Everything is in SI units and radians. A *place* is a string of the same form as in `discovery.json`:
//! `platform.force_x`, `platform.force_y`, `platform.torque`, `winch[3]`, `cable[2]`, `sensor.cable_length[1]`,
//! `sensor.unstretched_length[1]`, `sensor.pose`; `winch` and `cable` without an index mean all four. A *channel* is
//! a measured column under its FMU name: `x`, `phi`, `cable_length[1]`, `tension[4]`. Cable numbers count from 1,
//! indices into the vectors of this module from 0.

use serde::Serialize;

/// Everything that one report shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was examined, in a few words, e.g. the name of the measurement campaign or of the first data file.
    pub title: String,
    /// The outcome in one word.
    pub verdict: Verdict,
    /// The effects found, the most important first. Empty for [`Verdict::NoMissingEffect`].
    pub effects: Vec<Effect>,
    /// Where, when and depending on what the model disagrees, the largest share first.
    pub located: Vec<Located>,
    /// Effects of the model as given of which the data show nothing, each with its place: they were taken out.
    pub not_shown: Vec<String>,
    /// Whether the search left something undone because its time was over.
    pub ended_early: bool,
    /// What changed between training and held-out data, where nothing explains the gap: a sentence.
    pub changed: Option<String>,
    /// Terms outside the catalogue that were added as expressions.
    pub terms: Vec<Term>,
    /// The error of the model without and with what was found.
    pub gap: Gap,
    /// Every measured channel, in the order in which tables and pictures list them.
    pub channels: Vec<Channel>,
    /// What the instruments add to the recordings beside white noise; empty where the data do not ask for it.
    pub instruments: Vec<Instrument>,
    /// What stays unexplained, as forces.
    pub remainder: Remainder,
    /// The trials to plot, decimated by the caller (a few thousand samples each are plenty).
    pub trials: Vec<Trial>,
    /// The residual against the variable it depends on, one plot per effect or term.
    pub signatures: Vec<Signature>,
    /// The robot, for the drawing.
    pub robot: Robot,
    /// The files read and written.
    pub files: Vec<FileUsed>,
    /// Settings of the run in the order to be listed: name and value with unit.
    pub settings: Vec<Setting>,
    /// How the result was reached.
    pub method: Method,
    /// What the data would have shown of every other law: one row for each size, at the cable where it shows least.
    pub limits: Vec<Limit>,
    /// Whether they show nothing of any law that needs motion.
    pub at_rest: bool,
    /// Remarks and warnings for the reader, each a full sentence.
    pub remarks: Vec<String>,
    /// Whether errors of the geometry were found together with the laws; the model as given then has them corrected.
    pub corrected: bool,
}

/// The smallest size of a law that the data would have shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// The law with its place: `Coulomb friction on winch 3`.
    pub label: String,
    /// The kind of place: `winch`, `platform`, `sensor`.
    pub site: String,
    /// The parameter that is its size.
    pub parameter: String,
    /// The size in SI; `None` where they show nothing of it.
    pub size: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// Whether it shows up to this size rather than from it on.
    pub at_most: bool,
    /// Whether that is a size that such a robot may have.
    pub excited: bool,
    /// The shape for which it holds.
    pub shape: Vec<Parameter>,
}

/// The outcome of a discovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The model reproduces the data as well as the noise allows.
    NoMissingEffect,
    /// Every effect found is in the catalogue and the remaining residual is white.
    Named,
    /// Two or more explanations differ by less than the evidence can tell.
    Ambiguous,
    /// Effects of the catalogue explain most of the gap, and more than the noise is left.
    PartlyNamed,
    /// Part of the gap needs [`Report::terms`] outside the catalogue, or nothing explains it.
    Unnamed,
}

/// One effect found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// Id in the catalogue, e.g. `winch_coulomb_friction`.
    pub id: String,
    /// The catalogue's name for people, fit for the middle of a sentence, without the place: `Coulomb friction`.
    pub label: String,
    /// The place it acts on, e.g. `winch[3]`.
    #[serde(rename = "where")]
    pub place: String,
    /// The cable it acts on, from 1; `None` where it acts on the platform or on all cables.
    pub cable: Option<usize>,
    /// Whether it may be called what is missing; else it is listed only.
    pub named: bool,
    /// The law with the numbers found, in one line of plain text, e.g. `F = 180 tanh(l̇/0.02)`.
    pub equation: String,
    /// Its parameters, the one that tells its size first.
    pub parameters: Vec<Parameter>,
    /// Those of it in the model as given, where that has it with other numbers; else none.
    pub given: Vec<Parameter>,
    /// Bayesian information criterion with the effect minus without it; negative where the effect is supported.
    pub delta_bic: f64,
    /// Gap on held-out data (see [`Gap`]) with everything found *except* this effect; compare `gap.holdout.after`.
    pub holdout_gap_without: Option<f64>,
    /// The explanations that the data could hardly tell from this one, the nearest first.
    pub alternatives: Vec<Alternative>,
    /// Its size in blocks of time, where there was data enough for two.
    pub stability: Option<Stability>,
}

/// A fitted number.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Key in `model.toml`, e.g. `transition_speed`.
    pub name: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// One standard error, in `unit`; `None` where the parameter was held fixed.
    pub standard_error: Option<f64>,
    /// Unit as in the catalogue, e.g. `N s/m`; `1` for a pure number.
    pub unit: String,
}

/// An explanation that was nearly as good as the chosen one, or as good.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Alternative {
    /// Id in the catalogue.
    pub id: String,
    /// The catalogue's name for people, without the place.
    pub label: String,
    /// The place it would act on.
    #[serde(rename = "where")]
    pub place: String,
    /// The cable it would act on, from 1.
    pub cable: Option<usize>,
    /// Its parameters if it were the true one.
    pub parameters: Vec<Parameter>,
    /// BIC with this effect in place of the chosen one, minus BIC with the chosen one; near zero means a tie. Where it is far
    /// off, of the beginnings of the trials alone.
    pub delta_bic: f64,
    /// Correlation of the two whitened signatures, -1 to 1, where it was computed.
    pub correlation: Option<f64>,
    /// True where the evidence cannot tell the two apart: this is what makes the verdict `ambiguous`.
    pub indistinguishable: bool,
    /// The experiment that would separate them, an imperative clause without full stop: `repeat at 10 and 30 kN pretension`.
    pub separate_by: String,
}

/// A place where the model disagrees with the measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Located {
    /// The place, see the module's documentation.
    #[serde(rename = "where")]
    pub place: String,
    /// Share of the gap that sits here, 0 to 1.
    pub share_of_gap: f64,
    /// When it shows; empty where it is there all the time.
    pub when: Vec<Span>,
    /// What it depends on: `speed`, `direction`, `tension`, `position`, `time`, ...
    pub depends_on: Vec<String>,
}

/// A stretch of time in one of the plotted trials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Span {
    /// Index into [`Report::trials`].
    pub trial: usize,
    /// Start, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
}

/// A term outside the catalogue, added to the model as an expression.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Term {
    /// The axis it acts on, e.g. `platform.force_x` (N) or `platform.torque` (N m).
    pub target: String,
    /// The expression with its coefficients, as in `model.toml`.
    pub expression: String,
    /// One standard error for each coefficient of the expression, in the order in which they stand there.
    pub standard_errors: Vec<f64>,
    /// BIC with the term minus without it.
    pub delta_bic: f64,
    /// Gap on held-out data with everything found except this term.
    pub holdout_gap_without: Option<f64>,
    /// Its size in blocks of time, where there was data enough for two.
    pub stability: Option<Stability>,
}

/// Whether what was found has the same size throughout the data that were fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stability {
    /// The blocks that tell something of the size, in order.
    pub blocks: Vec<Block>,
    /// Weighted sum of squares of the deviations from one size; chi-square distributed if the size is constant.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// Probability of a larger one if the size is constant.
    pub p_value: f64,
    /// Standard deviation of the size from block to block beyond what its errors explain, in multiples of the size.
    pub spread: f64,
    /// Whether the size is constant as far as it matters.
    pub constant: bool,
}

/// The size in one block of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Block {
    /// The stretch of time.
    pub span: Span,
    /// Size in multiples of the size over all data.
    pub size: f64,
    /// One standard error, in the same multiples.
    pub standard_error: f64,
}

/// A number without and with what was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// With the model as given.
    pub before: f64,
    /// With what was found added to the model.
    pub after: f64,
}

/// Root mean square of (simulated - measured)/σ, where the simulation restarts every `horizon_s` seconds; 1.0 is
/// the noise floor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gap {
    /// Horizon of `train`, `holdout` and `channels`, s.
    pub horizon_s: f64,
    /// On the data that was fitted, all channels together.
    pub train: BeforeAfter,
    /// On held-out data, which are not fitted but take part in deciding what stays, all channels together; `None` where there was too little data to hold out.
    pub holdout: Option<BeforeAfter>,
    /// What was held out, as a noun phrase: `trial c.csv`, `the last 30 s of a.csv`. Empty where nothing was.
    pub holdout_source: String,
    /// The same for each channel.
    pub channels: Vec<ChannelGap>,
    /// The same for other horizons, e.g. 1, 5 and 20 s.
    pub horizons: Vec<HorizonGap>,
}

/// The gap in one channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelGap {
    /// Name out of [`Report::channels`].
    pub channel: String,
    /// On the data that was fitted.
    pub train: BeforeAfter,
    /// On held-out data.
    pub holdout: Option<BeforeAfter>,
}

/// The gap over one horizon, all channels together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HorizonGap {
    /// Time between restarts of the simulation, s.
    pub horizon_s: f64,
    /// On the data that was fitted.
    pub train: BeforeAfter,
    /// On held-out data.
    pub holdout: Option<BeforeAfter>,
}

/// A measured channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Channel {
    /// FMU name, e.g. `cable_length[1]`.
    pub name: String,
    /// Unit of the measurements, `m`, `rad` or `N`.
    pub unit: String,
    /// Measurement noise σ, estimated from the data, in `unit`.
    pub noise: f64,
    /// Number of samples used.
    pub samples: usize,
    /// Whiteness test of what remains after the fit, where it was made.
    pub whiteness: Option<Whiteness>,
}

/// A size of what an instrument adds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Instrument {
    /// What it is, and of which instrument.
    pub what: String,
    /// Its size, in `unit`.
    pub value: f64,
    /// Its standard error, where it is known.
    pub standard_error: Option<f64>,
    /// Unit of the size.
    pub unit: String,
}

/// Test of whether what remains looks like noise without memory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Whiteness {
    /// Name of the statistic: `Ljung-Box Q(20)`, ...
    pub name: String,
    /// Its value.
    pub statistic: f64,
    /// The confidence limit it has to stay below.
    pub limit: f64,
    /// Whether it does.
    pub pass: bool,
}

/// What stays unexplained, as root mean square of the latent wrench on the platform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Remainder {
    /// Force, N.
    pub force: f64,
    /// Torque, N m.
    pub torque: f64,
    /// The same force before anything was added, N.
    pub force_before: Option<f64>,
    /// The same torque before anything was added, N m.
    pub torque_before: Option<f64>,
}

/// One trial as plotted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// Name for people, usually the file's.
    pub name: String,
    /// Whether this is held-out data.
    pub holdout: bool,
    /// Time of each plotted sample, s, strictly increasing.
    pub time: Vec<f64>,
    /// The channels plotted, each as long as `time`.
    pub series: Vec<Series>,
    /// Residuals in blocks of time, for the time × channel picture.
    pub residuals: ResidualMap,
}

/// One channel over time. A gap in the measurements, and the sample at which a simulation restarts, is `NAN`: lines
/// break there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// Name out of [`Report::channels`].
    pub channel: String,
    /// Measured, in the channel's unit.
    pub measured: Vec<f64>,
    /// Simulated with the model as given.
    pub before: Vec<f64>,
    /// Simulated with what was found added.
    pub after: Vec<f64>,
    /// How far a model without fault would be from the measurements (root mean square, in the channel's unit): the noise, and
    /// what the instruments have beside it.
    pub expected: f64,
}

/// Root mean square of (simulated - measured)/σ in blocks of time.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ResidualMap {
    /// Borders of the blocks, s, increasing; one more than there are blocks. Empty for no picture.
    pub edges: Vec<f64>,
    /// One row per channel.
    pub rows: Vec<ResidualRow>,
}

/// One channel of a [`ResidualMap`]; `NAN` for a block without data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResidualRow {
    /// Name out of [`Report::channels`].
    pub channel: String,
    /// With the model as given, one number per block.
    pub before: Vec<f64>,
    /// With what was found added.
    pub after: Vec<f64>,
}

/// What the model misses, against the variable it depends on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Signature {
    /// The effect or term with its place, as a heading: `Coulomb friction on winch 3`.
    pub label: String,
    /// Name of the variable: `reel-out speed 3`.
    pub x_name: String,
    /// Its unit.
    pub x_unit: String,
    /// Name of the residual: `missing pull at winch 3`.
    pub y_name: String,
    /// Its unit.
    pub y_unit: String,
    /// Estimates from the data, (variable, residual); up to a few thousand.
    pub points: Vec<[f64; 2]>,
    /// The fitted law, sorted by the variable.
    pub law: Vec<[f64; 2]>,
}

/// Geometry of the robot, for the drawing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robot {
    /// Anchor (winch) of each cable in the base frame, m.
    pub anchors: Vec<[f64; 2]>,
    /// Attachment of each cable in the body frame, m.
    pub attachments: Vec<[f64; 2]>,
    /// Pose drawn: x (m), y (m), φ (rad).
    pub pose: [f64; 3],
    /// Path of the platform in the plotted trials, m; may be empty.
    pub path: Vec<[f64; 2]>,
}

/// A file that the run read or wrote.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FileUsed {
    /// What it is: `training data`, `held-out data`, `base model`, `FMU with what was found`.
    pub role: String,
    /// Its path as given or written.
    pub path: String,
}

/// A setting of the run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Name for people.
    pub name: String,
    /// Value with its unit.
    pub value: String,
}

/// How the result was reached.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Method {
    /// Different explanations tried.
    pub candidates: usize,
    /// Trials used for fitting.
    pub trials: usize,
    /// Samples used for fitting, all channels and trials together.
    pub samples: usize,
    /// Computing time, s.
    pub seconds: f64,
    /// False-alarm check, where it was made.
    pub null_test: Option<NullTest>,
    /// The search as it went: what was taken up, refused, taken out again.
    pub steps: Vec<Step>,
}

/// The weighing of all explanations repeated on data shifted in time and frequency, where only chance can explain anything.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NullTest {
    /// Shifts.
    pub runs: usize,
    /// Shifts in which chance may explain as much for an effect to be let in.
    pub allowed: usize,
    /// Shifts in which chance explained as much as what was found, the weakest where there is more than one; as much as
    /// the best explanation tried where nothing was found. `None` where the test does not apply to what was found.
    pub exceeded: Option<usize>,
    /// Shifts, of what remains unexplained in the end, in which chance would have been followed by the search.
    pub followed: Option<usize>,
}

/// One step of the search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// What was tried, with its place.
    pub label: String,
    /// What became of it: `added`, `refused`, `removed`, ...
    pub outcome: &'static str,
    /// BIC with it minus without it; none where it could not be tried.
    pub delta_bic: Option<f64>,
    /// Why, in a few words; may be empty.
    pub reason: String,
}
