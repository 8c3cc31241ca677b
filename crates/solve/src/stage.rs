//! The stages of an iteration, for whoever wants to know where the time goes. The solver has no clock.

/// What was just done, on the thread that did it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The state was frozen: powers, stand-ins, the table of the choice.
    Freeze,
    /// Rays were put in order of their first number.
    Order,
    /// A task is about to begin; the thread may have waited for others.
    Wait,
    /// Patches were chosen, points and directions drawn.
    Shoot,
    /// Rays were traced.
    Trace,
    /// Light at both ends was evaluated and turned into deposits.
    Estimate,
    /// Deposits were added to their patches and the state moved on.
    Deposit,
}

/// Told at the end of a stage.
pub(crate) type Lap<'a> = &'a (dyn Fn(Stage) + Sync);
