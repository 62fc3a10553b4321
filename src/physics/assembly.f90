!> The bodies of a scene: the blank and the tools.
module assembly
  use blank, only: blank_t
  use tool, only: tool_t
  implicit none
  private

  !> What effects act on.
  type, public :: assembly_t
    type(blank_t) :: blank
    type(tool_t), allocatable :: tools(:)
  end type assembly_t

end module assembly
