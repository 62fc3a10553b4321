!> How finely the tools are shown in the results.
module tool_display
  use kinds, only: wp
  use surface_grid, only: element_size_of, no_length
  use model, only: model_t
  implicit none
  private

  public :: tool_cell_length

contains

  !> Longest cell of a tool [length]: with contact pressure as long as the elements of the blank's
  !! first patch are on average, else without limit.
  real(wp) function tool_cell_length(model) result(length)
    type(model_t), intent(in) :: model

    length = no_length
    if (model%output%has_pressure) then
      length = element_size_of(model%bodies%blank%parts(1)%element%surface(6))
    end if
  end function tool_cell_length

end module tool_display
