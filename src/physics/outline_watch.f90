!> What the deck names by a part of the sheet, and whether an outline leaves anything of it.
module outline_watch
  use kinds, only: wp
  use input_errors, only: origin_t
  use element, only: element_t
  implicit none
  private

  public :: is_gone

  !> Control points that something holds, or elements that something looks at or loads.
  type, public :: watched_t
    type(origin_t) :: origin                    !! keyword that names them
    character(:), allocatable :: what           !! such as `the set edge`
    integer :: last_step = huge(1)              !! of the deck, in which they count
    logical, allocatable :: points(:, :)        !! along the sheet, shape (n1, n2), or
    logical, allocatable :: elements(:, :)      !! elements along the sheet
    logical :: is_reported = .false.            !! that they are gone
  end type watched_t

contains

  !> Is nothing left of them? Control points must move for themselves: those that follow others at
  !! the edge hold nothing.
  pure logical function is_gone(watched, element)
    type(watched_t), intent(in) :: watched
    class(element_t), intent(in) :: element

    is_gone = .false.
    if (.not. allocated(element%ties%share)) return
    if (allocated(watched%points)) then
      is_gone = .not. any(watched%points .and. element%ties%is_free)
    else
      is_gone = .not. any(watched%elements .and. element%ties%share > 0.0_wp)
    end if
  end function is_gone

end module outline_watch
