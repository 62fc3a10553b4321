!> The plane in which a strip is worked.
module plane_strain_data
  use kinds, only: wp
  use ig_patch, only: tile_buffer_t
  implicit none
  private

  !> What a patch in plane strain has besides its tables. It is one element wide along axis 2,
  !! linear across with one integration point there, and held so that its two sides move alike.
  type, public :: plane_strain_t
    integer :: kernel = 0           !! instance, see plane_dispatch
    !> Components of the plane, that across, and the place of the plane's shear in a tensor.
    integer :: places(4) = 0
    real(wp) :: across = 0.0_wp     !! d/dxi_2 of the coordinate across [length]
    real(wp) :: half = 0.0_wp       !! the same with the sign that makes determinants positive
    !> Forces of each tile on the upper side, all components, rows along axis 2 being that one.
    type(tile_buffer_t), allocatable :: sides(:)
  end type plane_strain_t

end module plane_strain_data
