//! Every threshold by which a verdict is reached, each with its unit and the reason for its size.

/// Thresholds of the verdict.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Policy {
    /// Gap, in multiples of what a faultless model would leave, up to which what is left is noise: the noise itself is
    /// known to some tens of per cent where sensors are not quite white.
    pub(crate) at_noise: f64,
    /// The same below which a free run says nothing: it misses by the noise at least, so what it was expected to miss by is wrong, as along a
    /// trajectory that has run away.
    pub(crate) least: f64,
    /// The same from which on a recording is unlike others that are at the noise: twice that, for by chance one comes to half as much again.
    pub(crate) unlike: f64,
    /// The same up to which nothing is left to explain, where it decides whether more is looked for.
    pub(crate) nothing_left: f64,
    /// Gap of a faultless model, in multiples of the noise, up to which a free run says something: beyond it the run shows
    /// how an error of its start grows, and no longer what the model is missing.
    pub(crate) farthest: f64,
    /// Share of the gap, both without the noise, that what was found may leave at most to be an explanation of it: half.
    pub(crate) explained: f64,
    /// Share of the squared gap, both without the noise, that one effect must take away to be worth a headline: what takes
    /// less is not seen in any picture.
    pub(crate) headline: f64,
    /// Share of what training data of the same length gain by an effect that held-out data must gain where no gap shows it:
    /// half, for they are other motions.
    pub(crate) holds: f64,
    /// Standard error of an effect's size, in multiples of the size, from which the effect may be chance: of fifty laws,
    /// as many as the catalogue has, one comes to 3.7 standard errors in one of a hundred recordings with nothing missing.
    pub(crate) uncertain: f64,
    /// Factor by which a shape may leave the range met in practice before the law is no longer itself.
    pub(crate) out_of_range: f64,
    /// Standard errors by which it must have left it: two, for nearer by it may well be inside.
    pub(crate) out_by: f64,
    /// Share of the mean winch force below which a force at random does not matter: drives and load cells are no better.
    pub(crate) small_force: f64,
    /// The same up to which a force at random is one that acts on such machines, as wind does: half a per cent, as good load
    /// cells and drives are. Above it too much could hide behind it to say that nothing is missing.
    pub(crate) random_force: f64,
    /// Spread of an effect's size over blocks of time from which, where no free run says that it is what was missing, it stands for a
    /// law of another form: a tenth, for beside another law that is missing a right one is off by less.
    pub(crate) unsteady: f64,
    /// Share of the winch forces' variance that may act without being recorded: with more than a tenth of it at random, the
    /// recordings say little of what the model makes of forces.
    pub(crate) unrecorded: f64,
    /// Control runs, of 99, in which chance may explain as much as an effect that is taken up: one in a hundred.
    pub(crate) by_chance: usize,
    /// Share of the squared gap on held-out data that effects must take away over some horizon, and twice of which they may
    /// add over another: the least scatter of a gap over some thousand samples. It is more where free runs differ more.
    pub(crate) scatter: f64,
    /// Standard errors by which a gap on held-out data must shrink for free runs to show an effect: two. Free runs are few and
    /// differ in how far they go, so that no effect, whatever its size, comes to many more.
    pub(crate) beyond_scatter: f64,
}

/// The thresholds in use.
pub(crate) const POLICY: Policy = Policy {
    at_noise: 1.5,
    least: 0.1,
    unlike: 3.0,
    nothing_left: 1.1,
    farthest: 3.0,
    explained: 0.5,
    headline: 0.1,
    holds: 0.5,
    uncertain: 0.27,
    out_of_range: 3.0,
    out_by: 2.0,
    small_force: 1e-3,
    random_force: 5e-3,
    unsteady: 0.1,
    unrecorded: 0.1,
    by_chance: 1,
    scatter: 0.005,
    beyond_scatter: 2.0,
};
