!> What the returns to anisotropic yield surfaces start from.
module return_problem
  use kinds, only: wp
  use deviator_lanes, only: lanes
  implicit none
  private

  !> What stays the same during the return. Points that do not flow take part with any numbers.
  type, public :: return_problem_t
    real(wp) :: eqps(lanes), factor(lanes)      !! before the increment; factor on the flow stress
    real(wp) :: flow(lanes), slope(lanes)       !! flow stress and slope there
    real(wp) :: guess(lanes)                    !! of the plastic strain, see `begin_at`
    real(wp) :: trial(lanes, 5)                 !! stress
    real(wp) :: outset(lanes, 5)                !! relative stress whose direction is the start
    real(wp) :: shear                           !! [stress]
    real(wp) :: dt                              !! [time]
  end type return_problem_t

end module return_problem
