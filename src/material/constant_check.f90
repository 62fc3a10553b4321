!> Checks that all constants of materials share.
module constant_check
  use kinds, only: wp
  use failure, only: error_t, fail
  implicit none
  private

  public :: check_finite, check_count, require

contains

  !> All of them numbers, and finite.
  pure subroutine check_finite(what, constants, error)
    character(*), intent(in) :: what         !! such as "constants of the yield function"
    real(wp), intent(in) :: constants(:)
    type(error_t), allocatable, intent(inout) :: error

    call require(all(abs(constants) <= huge(1.0_wp)), &
                 "material: the "//what//" must be finite numbers", error)
  end subroutine check_finite

  !> As many as there should be.
  pure subroutine check_count(owner, constants, n, expected, error)
    character(*), intent(in) :: owner        !! such as "the hardening VOCE"
    real(wp), intent(in) :: constants(:)
    integer, intent(in) :: n
    character(*), intent(in) :: expected     !! such as "three constants: sigma_0, Q, b"
    type(error_t), allocatable, intent(inout) :: error

    call require(size(constants) == n, "material: "//trim(owner)//" takes "//expected, error)
  end subroutine check_count

  !> Reject with `message` what is not met, unless something was rejected before.
  pure subroutine require(is_met, message, error)
    logical, intent(in) :: is_met
    character(*), intent(in) :: message
    type(error_t), allocatable, intent(inout) :: error

    if (.not. (is_met .or. allocated(error))) call fail(error, message)
  end subroutine require

end module constant_check
