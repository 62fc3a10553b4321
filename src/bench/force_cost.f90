!> Floating-point operations and bytes of the force routine, by formula.
!!
!! Counted from the loops of `element/solid/ig_solid_kernel.inc`, `point_kinematics` and the Voce
!! law: a multiply-add counts 2, all else (also min, max, division, root) counts 1. Padded lanes do
!! not count, nor do tables, gathers and the adding of tiles.
module force_cost
  use kinds, only: wp
  implicit none
  private

  public :: kernel_flops, law_flops, force_bytes

contains

  !> Operations of the kernel for one element, without those of the law.
  pure real(wp) function kernel_flops(p, q, is_rational, is_viscous) result(flops)
    integer, intent(in) :: p(3), q(3)         !! degrees, points
    logical, intent(in) :: is_rational, is_viscous
    integer :: contractions, expansions, per_point, n(3)

    n = p + 1
    ! Differences count once, as the tuned kernels take them for all points of an axis.
    contractions = 6*n(2)*n(3)*(p(1) + q(1)*(4*p(1) - 1)) &
                   + q(1)*6*(n(3)*(2*p(2) + q(2)*(6*p(2) - 1)) + q(2)*3*p(3))
    expansions = q(1)*q(2)*3*(q(3)*(2 + 6*p(3)) + 3*p(3)) &
                 + q(1)*3*n(3)*(q(2)*(2 + 6*p(2)) + 2*p(2)) &
                 + 3*n(2)*n(3)*(q(1)*(1 + 4*p(1)) + p(1))
    ! Gradients, cofactors, strain increment, rotation, work, and weighted stress times cofactors.
    per_point = 6*(6*p(3) - 1) + 33 + 123 + 39 + 91 + 26 + 51
    if (is_viscous) per_point = per_point + 16
    if (is_rational) then
      per_point = per_point + 6*(2*p(3) + 6) + 2
      expansions = expansions + q(1)*q(2)*3*q(3)*(6 + 2*p(3)) + 9*product(n)
    end if
    flops = real(contractions + expansions + per_point*product(q), wp)
  end function kernel_flops

  !> Operations of a law at one point, 0 where they are not counted: those of Voce yielding with two
  !! steps of Newton's method, of Voce staying elastic, and of the elastic law.
  pure real(wp) function law_flops(law)
    character(*), intent(in) :: law

    select case (law)
    case ("voce")
      law_flops = 127.0_wp
    case ("voce_elastic")
      law_flops = 37.0_wp
    case ("elastic")
      law_flops = 18.0_wp
    case default
      law_flops = 0.0_wp
    end select
  end function law_flops

  !> Bytes to and from memory for one element: state of the points read and written, the tables of
  !! weights read, positions and velocities read, forces written, read and written.
  pure real(wp) function force_bytes(n_points, n_state, controls, is_rational) result(bytes)
    integer, intent(in) :: n_points, n_state
    real(wp), intent(in) :: controls           !! control points an element
    logical, intent(in) :: is_rational

    bytes = 16.0_wp*n_points*(6 + n_state) + 8.0_wp*controls*(6 + 3*3)
    if (is_rational) bytes = bytes + 8.0_wp*(5*n_points + controls)
  end function force_bytes

end module force_cost
