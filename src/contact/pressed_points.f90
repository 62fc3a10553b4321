!> Points of one tile that touch a tool, or did so at the call before: one value a point in each
!! array, so that springs, dampers and friction work on eight points at a time. A point touches as
!! soon as it is in the tool, also while its spring has no load yet.
module pressed_points
  use kinds, only: wp
  use contact_tiles, only: tile_size
  implicit none
  private

  integer, parameter, public :: most_points = tile_size**2   !! of a tile

  !> The first `n` of each array are set.
  type, public :: pressed_points_t
    integer :: n
    integer :: point(most_points)              !! number on the face
    logical :: was_touching(most_points)       !! at the call before
    real(wp) :: stiffness(most_points)         !! of the penalty [force/length]
    real(wp) :: push(most_points)              !! along the normal, 0: no load now [force]
    real(wp) :: normal(most_points, 3)         !! unit, off the tool; 0 where it has left
    real(wp) :: moved(most_points, 3)          !! against the tool since the call before [length]
    real(wp) :: drag(most_points, 3)           !! along the tool [force]
  end type pressed_points_t

end module pressed_points
